"""Which hypotheses the diagnosis tries of each effect."""

from dataclasses import replace

import numpy as np
import pytest

from airtouch.gap.result import NamedEffect, Quantity
from airtouch.gap.signatures.alike import interchangeable, names_alike
from airtouch.gap.signatures.candidates import (
    all_candidates,
    is_random,
    passing_variants,
    shows_in,
    strength_term,
    term_of,
    terms,
    terms_of,
)
from airtouch.gap.signatures.signature import CLOCK, MEAN, SPECTRUM
from airtouch.simulation.effects import EFFECTS, get


def kinds(variant):
    return [(t.name, t.shows_in, t.companion) for t in variant]


def test_every_effect_of_the_registry_is_a_candidate_but_those_left_out():
    assert list(all_candidates()) == list(EFFECTS)
    assert set(EFFECTS) - all_candidates(["mass", "wind"]).keys() == {"mass", "wind"}


def test_a_weak_motor_is_tried_at_each_rotor():
    assert [t.values["rotor"] for t in terms("weak_motor")] == [1, 2, 3, 4]


def test_gains_are_tried_together_and_one_by_one():
    together, *alone = terms("controller_gain")
    assert [t.free for t in alone] == [(p,) for p in together.free] and len(together.free) == 4


def test_a_ground_effect_is_tried_without_and_with_its_random_part():
    """The turbulence turns the vehicle about its vertical axis in one variant, and does not in the other."""
    variants = all_candidates()["ground_effect"]
    steady, *unsteady = (variants[i:i + len(variants) // 3] for i in range(0, len(variants), len(variants) // 3))
    assert all(kinds(v) == [("ground_effect", MEAN, False)] for v in steady)
    assert [[v[:1] for v in part] for part in unsteady] == [steady, steady]
    assert all(kinds(v[1:]) == [("ground_effect", SPECTRUM, True)] for part in unsteady for v in part)
    assert [{v[1].values["swirl"] for v in part} for part in unsteady] == [{0.0}, {0.01}]
    assert all(v[0].values["turbulence"] == 0.0 for v in variants)


def test_a_wake_is_never_tried_without_its_random_part():
    for variants in (all_candidates()["downwash"], passing_variants()["downwash"]):
        assert [kinds(v) for v in variants] == [[("downwash", MEAN, False), ("downwash", SPECTRUM, True)]]
    assert strength_term(variants[0]) is variants[0][1]
    assert is_random("downwash") and not is_random("ground_effect")


def test_moving_air_has_drag_beside_it_unless_drag_is_left_out():
    for name in ("wind", "gust"):
        variants = all_candidates()[name]
        assert [len(v) for v in variants] == [1] * len(terms(name)) + [2] * len(terms(name))
        assert kinds(variants[-1])[1] == ("rotor_drag", MEAN, True)
        assert all(len(v) == 1 for v in all_candidates(["rotor_drag"])[name] + passing_variants()[name])


def test_a_passing_wind_blows_along_the_ground():
    """Its vertical part would act through the tilt alone; one that always acts has it. Others free what they do."""
    assert {t.free for t, *_ in passing_variants()["wind"]} == {("x", "y")}
    assert {t.free for t, *_ in all_candidates()["wind"]} == {("x", "y", "z")}
    assert {t.free for t, *_ in passing_variants()["downwash"]} == {("strength",)}
    x = Quantity(0.5, 0.3, 0.7, "m/s")
    for seconds, free in (((), ("x", "y", "z")), ((("a.csv", 1.0, 2.0),), ("x", "y"))):
        assert term_of(NamedEffect("wind", {"x": x}, seconds)).free == free


@pytest.mark.parametrize(("name", "where"), [("mass", MEAN), ("gust", SPECTRUM), ("packet_loss", CLOCK)])
def test_an_effect_shows_where_its_record_says(name, where):
    assert shows_in(get(name)) == where and all(t.shows_in == where for t in terms(name))


@pytest.mark.parametrize(("like", "where"), [("gust", SPECTRUM), ("rotor_drag", MEAN), ("time_jitter", MEAN)])
def test_an_effect_without_a_record_is_random_where_two_seeds_give_two_forces(like, where):
    assert shows_in(replace(get(like), name="of one's own")) == where


def test_mass_and_thrust_are_two_names_of_one_thing():
    assert interchangeable("mass", "thrust_coefficient") and interchangeable("wind", "wind")
    assert not interchangeable("mass", "inertia") and names_alike("inertia") is None


def test_a_named_effect_is_its_own_variant_again():
    (own,) = (t for t in terms("motor_noise") if t.values["time"] == 0.02)
    values = own.quantities(own.scaled({**own.values, "rms": 0.05}))
    again = term_of(NamedEffect("motor_noise", values, (("flight", 1.0, 2.0),)))
    assert again.values == {**own.values, "rms": pytest.approx(0.05)}
    assert again.gate == (("flight", 1.0, 2.0),) and again.shows_in == SPECTRUM


def test_a_gain_that_was_named_alone_is_its_own_term_with_its_values():
    alone = terms("controller_gain")[3]
    found = NamedEffect("controller_gain", alone.quantities(np.array([0.4])))
    assert term_of(found).values == alone.at(np.array([0.4]))


def test_several_gains_are_the_term_in_which_all_of_them_are_free():
    together = terms("controller_gain")[0]
    lower = together.quantities(together.scaled({"rate": 0.9, "attitude": 0.7, "position": 0.8, "height": 0.95}))
    assert term_of(NamedEffect("controller_gain", lower)).free == together.free


@pytest.mark.parametrize(("name", "strength", "turbulence"), [
    ("ground_effect", 1.6, 0.2), ("ground_effect", 1.6, 0.0), ("downwash", 0.02, 5.0)])
def test_a_named_effect_is_a_steady_mean_and_a_random_part_with_all_of_its_force(name, strength, turbulence):
    """The random force is the strength times the turbulence; it acts in the seconds of the effect."""
    seconds = (("one.csv", 1.0, 2.0),)
    named = NamedEffect(name, {"strength": Quantity(strength), "turbulence": Quantity(turbulence),
                               "swirl": Quantity(0.01, unit="m")}, seconds)
    mean, *random = terms_of(named)
    assert (mean.shows_in, mean.values["turbulence"], mean.values["strength"]) == (MEAN, 0.0, strength)
    assert [(t.shows_in, t.gate) for t in random] == [(SPECTRUM, seconds)] * (turbulence > 0.0)
    for part in random:
        assert part.values["strength"] * part.values["turbulence"] == pytest.approx(strength * turbulence)
        assert part.values["swirl"] == 0.01
