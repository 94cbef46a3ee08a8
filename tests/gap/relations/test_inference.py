"""Which effects are inferred in flights of known effects, with all of them in the library or some withheld."""

from dataclasses import replace

import numpy as np
import pytest

from airtouch.gap.evidence.counterevidence import Counterevidence
from airtouch.gap.relations import inference
from airtouch.gap.relations.effect_class import ClassCalibration
from airtouch.gap.relations.hypotheses import FlightHypotheses, LearnedModel
from airtouch.gap.relations.inference import infer, model_of_mean
from airtouch.gap.relations.library import NominalDistance
from airtouch.gap.relations.readout import Readout
from axis_library import NAMES, Q, each_calibrated, library, noise

SIZE = (45.0, 30.0, 12.0)


@pytest.mark.parametrize("true", [(), ("mass",), ("mass", "wind"), ("vibration", "inertia", "gust")])
def test_inference_names_what_is_there(true):
    values = noise() + sum(size * np.eye(Q)[NAMES.index(n)] for size, n in zip(SIZE, true, strict=False))
    inference = infer(library(), values[None])
    assert {c.name for c in inference.classes} == set(true)
    assert inference.counterevidence.nats < inference.counterevidence.limit
    chance = inference.probabilities()
    assert sum(chance.values()) == pytest.approx(1.0)
    assert max(chance, key=chance.__getitem__) == (true[0] if true else "none")


def test_a_withheld_effect_is_left():
    values = (noise() + 45.0 * np.eye(Q)[0])[None]
    inference = infer(library().without(["mass"]), values)
    assert not inference.classes and inference.counterevidence.nats > 10.0 * inference.counterevidence.limit
    assert inference.evidence.keys() == set(NAMES[1:])


@pytest.mark.parametrize("off", [0.0, 3.0, 4.0])
def test_a_name_fails_where_the_flight_lies_off_it_by_more_than_right_names_do(off):
    """The squared distance of 100 coordinates scatters by sqrt(200): the limit is 3.5 times half of that, in nats."""
    scatter = 0.5 * np.sqrt(2.0 * Q)
    values = 45.0 * np.eye(Q)[0]
    values[60:] = np.sqrt((Q + 2.0 * off * scatter) / 40.0)  # as far from the effect as nominal flights, and more
    inference = infer(library(), values[None])
    assert [c.name for c in inference.classes] == ["mass"]
    assert (inference.counterevidence.nats < inference.counterevidence.limit) is (off < 3.5)


def test_a_name_that_is_known_to_be_inexact_may_be_farther_off():
    values = noise() + 45.0 * np.eye(Q)[0]
    values[60:] *= 2.5
    exact = each_calibrated(library(), nameless_share=1.0)  # so that the distance alone speaks
    inexact = each_calibrated(exact, distance_scatter=0.1)
    far, near = (infer(of, values[None]) for of in (exact, inexact))
    assert far.counterevidence.nats == pytest.approx(near.counterevidence.nats)
    assert far.counterevidence.limit < far.counterevidence.nats < near.counterevidence.limit
    evidence = near.evidence["mass"]
    assert near.counterevidence.limit == pytest.approx(3.5 * np.hypot(0.5 * np.sqrt(2.0 * Q), 0.1 * evidence))


def test_two_effects_must_be_likelier_than_one_with_something_without_a_name(monkeypatch):
    """A withheld direction that two effects together resemble."""
    both = (np.eye(Q)[0] + np.eye(Q)[1]) / np.sqrt(2.0)
    values = (noise() + 25.0 * both)[None]
    assert len(infer(library(), values).classes) == 2
    monkeypatch.setattr(inference, "NAMELESS_MARGIN", 1000.0)
    assert len(infer(library(), values).classes) == 1


def test_the_mean_of_flights_is_as_one_of_less_noise():
    """Four flights: evidence is that of one whose noise is half as large, whose shift is twice as long."""
    way = np.eye(Q)[0]
    four, mean_flight = np.tile(3.0 * way, (4, 1)), 6.0 * way
    of_mean = replace(library(), model=model_of_mean(library().model, 4))
    assert infer(library(), four).evidence["mass"] == pytest.approx(infer(of_mean, mean_flight[None]).evidence["mass"])
    assert infer(library(), four).evidence["mass"] > infer(library(), four[:1]).evidence["mass"] + 10.0


def test_scatter_between_flights_averages_out():
    scattered = replace(library().model.classes[0], axes=np.eye(Q)[:, 1:2], variances=np.array([0.4]))
    mean = model_of_mean(LearnedModel((scattered,), np.zeros((Q, 0)), np.zeros((Q, 0))), 4).classes[0]
    shift = mean.mean(np.array([[2.0]]))[0]
    # of the mean times 2: 4 (1 + 2^2 0.4) / 4
    assert 1.0 + (shift @ shift) * mean.variances[0] == pytest.approx(1.0 + 2.0 ** 2 * 0.4)


@pytest.mark.parametrize(("other", "effect", "may"), [
    ("wind", "wind", True), ("mass", "mass", False), ("thrust_coefficient", "thrust_coefficient", False),
    ("mass again", "mass", True)])
def test_what_may_stand_beside_a_mass(other, effect, may):
    """Another name of it may not, another parameter of the same effect may if each has a class of its own."""
    mass = FlightHypotheses(noise() + 45.0 * np.eye(Q)[0], library().model).with_class(library().model.classes[0])
    assert inference.may_stand_beside(replace(mass.fits[0].effect_class, name=other, effect=effect), mass) is may


def test_no_more_effects_are_named_than_a_flight_may_have(monkeypatch):
    monkeypatch.setattr(inference, "NAMELESS_MARGIN", -np.inf)  # four equal effects resemble a nameless disturbance
    values = noise() + sum(30.0 * np.eye(Q)[i] for i in range(4))
    assert len(infer(library(), values[None]).classes) == inference.MOST_EFFECTS


def test_a_second_effect_needs_a_share_of_the_firsts_evidence():
    """The share that wrong ones gain beside that effect: of 1000 nats, a twentieth is more than the second one has."""
    values = (noise() + 45.0 * np.eye(Q)[0] + 10.0 * np.eye(Q)[1])[None]
    with_share = each_calibrated(library(), second_share=0.05)
    assert {c.name for c in infer(library(), values).classes} == {"mass", "wind"}
    assert {c.name for c in infer(with_share, values).classes} == {"mass"}


def test_what_a_disturbance_may_gain_grows_with_the_evidence_and_once_more_for_two_effects(monkeypatch):
    """The distance says nothing here: nominal flights scatter widely."""
    monkeypatch.setattr(inference, "NAMELESS_MARGIN", -np.inf)
    wide = replace(library(), distance=NominalDistance(float(Q), 1e6))
    for true, share in (((45.0,), 0.01), ((45.0, 30.0), 0.02)):
        values = noise(4) + sum(size * np.eye(Q)[i] for i, size in enumerate(true))
        values[60:] *= 2.5
        flight = FlightHypotheses(values, wide.model)
        best = flight.with_class(wide.model.classes[0])
        if len(true) == 2:
            best = flight.with_two(*wide.model.classes[:2])
        result = infer(wide, values[None])
        assert len(result.classes) == len(true)
        assert result.counterevidence.limit == pytest.approx(10.0 + share * best.evidence, rel=1e-3)
        assert result.counterevidence.nats == pytest.approx(flight.nameless_evidence(best) - best.evidence, rel=1e-2)


def test_two_parameters_of_one_effect_have_no_readings():
    """Each was calibrated acting alone."""
    size = np.geomspace(1.0, 100.0, 30)[:, None]
    gains = tuple(replace(c, name=f"controller_gain {p}", effect="controller_gain",
                          calibration=ClassCalibration(Readout((p,), size, 0.01 * size)))
                  for c, p in zip(library().model.classes[:2], ("rate", "attitude"), strict=True))
    known = library().with_classes(gains)
    rate, attitude = 45.0 * np.eye(Q)[0], 30.0 * np.eye(Q)[1]
    one, both = (infer(known, (noise() + x)[None]) for x in (rate, rate + attitude))
    assert list(one.readings) == ["controller_gain"]
    assert len(both.classes) == 2 and not both.readings


def test_an_effect_in_several_shapes_has_the_mean_of_their_likelihoods():
    first = library().model.classes[0]
    shapes = (replace(first, shape=1.0), replace(first, shape=2.0, table=np.tile(np.eye(Q)[50], (1, 3, 1))))
    of = library().with_classes(shapes)
    values = (noise() + 30.0 * np.eye(Q)[0])[None]
    alone = infer(library(), values).evidence["mass"]
    assert infer(of, values).evidence["mass"] == pytest.approx(alone - np.log(2.0))


def test_probabilities_are_those_of_half_the_evidence():
    """Tails are heavier than normal ones; what has the least evidence of an effect is as likely as none."""
    evidence = {"mass": inference.LEAST_EVIDENCE, "wind": inference.LEAST_EVIDENCE - 4.0}
    chance = inference.Inference((), evidence, Counterevidence(0.0, 1.0, False)).probabilities()
    assert chance["mass"] == pytest.approx(chance["none"])
    assert chance["wind"] == pytest.approx(chance["mass"] * np.exp(-2.0))


def test_another_name_of_the_likeliest_effect_is_not_added_to_it():
    classes = (library().model.classes[0], replace(library().model.classes[1], name="thrust_coefficient",
                                                   effect="thrust_coefficient"))
    of = library().with_classes(classes)
    assert len(infer(of, (noise() + 45.0 * np.eye(Q)[0] + 30.0 * np.eye(Q)[1])[None]).classes) == 1


def test_a_third_effect_is_added_only_where_two_do_not_suffice(monkeypatch):
    """Two effects with a weak third: the two lie within what right names leave, until the third is strong."""
    monkeypatch.setattr(inference, "NAMELESS_MARGIN", -np.inf)
    for size, count in ((6.5, 2), (30.0, 3)):
        values = noise() + 45.0 * np.eye(Q)[0] + 30.0 * np.eye(Q)[1] + size * np.eye(Q)[2]
        wide = each_calibrated(library(), nameless_share=0.05)
        result = infer(wide, values[None])
        assert len(result.classes) == count
        assert not result.counterevidence.is_too_much


def test_names_of_one_thing_count_together():
    """Mass and thrust coefficient are one thing: together likelier than another effect that is a little ahead of each.

    The classes differ by how long they may be: each is fitted to the same shift.
    """
    one = library().model.classes[0]
    names = ["mass", "thrust_coefficient", "battery_sag"]
    spread = [one.knots, one.knots, one.knots + np.array([0.1, *np.zeros(len(one.knots) - 1)])]  # shorter: likelier
    classes = tuple(replace(one, name=n, effect=n, knots=k) for n, k in zip(names, spread, strict=True))
    alike = library().with_classes(classes)
    values = (noise() + 45.0 * np.eye(Q)[0])[None]
    result = infer(alike, values)
    assert result.likeliest == "battery_sag"
    assert [c.effect for c in result.classes] == ["mass"]
    assert [c.effect for c in infer(alike.without(["mass"]), values).classes] == ["battery_sag"]
