"""The residual: at the ends of a flight, of passing effects, and of one flight beside another."""

from dataclasses import replace

import numpy as np
import pytest

from airtouch.gap.flights.flight import PERIOD_S
from airtouch.gap.signals.channels import FORCE, ONSET_S, TORQUE, ReplayedFlight, inside, residual, share_inside
from airtouch.simulation.effects import Active, get
from gap_flights import VEHICLE, flight

SECONDS = 6.0
GATE = (("synthetic", 1.0, 2.0), ("synthetic", 3.5, 4.25), ("another", 0.0, 6.0))


def heavier(fraction, gate=()):
    return Active(get("mass"), get("mass").values({"fraction": fraction}), gate)


def within(*stretches):
    """Samples (n,) in stretches from and to so many seconds."""
    t = np.arange(round(SECONDS / PERIOD_S)) * PERIOD_S
    return np.any([(t > begin - 1e-9) & (t < end - 1e-9) for begin, end in stretches], axis=0)


def test_the_end_of_a_flight_without_a_gyro_knows_nothing_of_its_beginning():
    """A vehicle that rolls at first and hovers in the end."""
    hover = replace(flight(4.0), rates=None)
    pwm = hover.pwm.copy()
    pwm[:50, :2] += 3000.0
    torque = residual(replace(hover, pwm=pwm), VEHICLE)[:, TORQUE]
    assert np.abs(torque[0]).max() > 1.0
    assert torque[-1] == pytest.approx(residual(hover, VEHICLE)[-1, TORQUE], abs=1e-3)


def test_a_gate_holds_the_samples_of_its_own_flight_from_each_beginning_to_before_each_end():
    np.testing.assert_array_equal(inside(GATE, flight(SECONDS)), within((1.0, 2.0), (3.5, 4.25)))


def test_an_effect_sets_in_and_ceases_along_half_a_cosine_about_the_ends_of_its_gate():
    """One half at the ends, all of it from half of ONSET_S inside, nothing from there outside; of one flight alone."""
    hover, half = flight(SECONDS), 0.5 * ONSET_S
    share = share_inside(GATE, hover)
    np.testing.assert_array_equal(share == 1.0, within((1.0 + half, 2.0 - half + PERIOD_S),
                                                       (3.5 + half, 4.25 - half + PERIOD_S)))
    np.testing.assert_allclose(share[[100, 200, 350, 425]], 0.5)
    np.testing.assert_allclose(share[100 - 7], 0.5 * (1.0 - np.sin(np.pi * 0.07 / ONSET_S)))
    assert not share[:85].any() and not share[216:335].any() and not share[441:].any()
    assert share_inside(GATE, replace(hover, name="another"))[100:500].all(), "its own stretch"
    assert not share_inside(GATE, replace(hover, name="a third")).any()


def test_a_gated_effect_acts_in_its_seconds_alone():
    """A vehicle heavier by a share is accelerated less by the same thrust T: by T / m (1 - 1 / (1 + share))."""
    hover = flight(SECONDS)
    without, gated = residual(hover, VEHICLE), residual(hover, VEHICLE, [heavier(0.2, GATE)])
    share = share_inside(GATE, hover)
    np.testing.assert_array_equal(gated[share == 0.0], without[share == 0.0])
    lift = 4.0 * VEHICLE.thrust(np.array([40000.0]))[0] / VEHICLE.mass_kg
    expected = share * lift * (1.0 - 1.0 / 1.2)
    np.testing.assert_allclose((gated - without)[:, FORCE.stop - 1], expected, atol=1e-3 * lift)


def test_two_gated_effects_beside_one_that_always_acts_add_up_where_both_act():
    hover, sideways = flight(SECONDS), get("wind").values({"x": 2.0, "y": 0.0})
    early, late = (Active(get("wind"), sideways, (("synthetic", *s),)) for s in ((1.0, 3.0), (2.0, 4.0)))
    always = heavier(0.2)
    one = residual(hover, VEHICLE, [always, replace(early, gate=())]) - residual(hover, VEHICLE, [always])
    both = residual(hover, VEHICLE, [always, early, late]) - residual(hover, VEHICLE, [always])
    count = share_inside(early.gate, hover) + share_inside(late.gate, hover)
    np.testing.assert_allclose(both[:, FORCE], count[:, None] * one[:, FORCE], atol=1e-12)
    assert np.abs(one[:, FORCE]).min(axis=0)[0] > 1e-3


def test_what_is_cached_for_one_flight_vehicle_or_seed_is_not_given_for_another():
    """All share effects, by which residuals are cached; each is that of a fresh object."""
    hover, other = flight(SECONDS), flight(SECONDS, force=np.array([0.0, 0.0, 0.3]))
    heavy = replace(VEHICLE, mass_kg=1.5 * VEHICLE.mass_kg)
    gust = Active(get("gust"), get("gust").values(), GATE)
    objects = [ReplayedFlight(*key) for key in ((hover, VEHICLE), (other, VEHICLE), (hover, heavy),
                                                (hover, VEHICLE, None, 1))]
    first = [r.residual([gust]) for r in objects]
    for r, values in zip(objects, first, strict=True):
        np.testing.assert_array_equal(r.residual([gust]), values)  # from the cache
        np.testing.assert_array_equal(residual(r.flight, r.vehicle, [gust], r.loop, r.seed), values)
        assert sum(np.array_equal(values, x, equal_nan=True) for x in first) == 1
    changed = replace(objects[0], vehicle=heavy)
    np.testing.assert_array_equal(changed.residual([gust]), first[2])


def test_what_is_cached_is_made_once_and_not_changed_by_gates(monkeypatch):
    replayed, runs = ReplayedFlight(flight(SECONDS), VEHICLE), []
    ungated = ReplayedFlight._ungated
    monkeypatch.setattr(ReplayedFlight, "_ungated", lambda self, active: runs.append(active) or ungated(self, active))
    gates = [(("synthetic", t, t + 0.5),) for t in np.arange(1.0, 5.0)]
    outcomes = [replayed.residual([heavier(0.2, gate)]) for gate in gates]
    assert len(runs) == 2  # with the effect and without
    for gate, values in zip(gates, outcomes, strict=True):
        np.testing.assert_array_equal(values, residual(replayed.flight, VEHICLE, [heavier(0.2, gate)]))
