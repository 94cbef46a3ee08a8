"""Passing effects: gates found in flights into which one was injected, and none where none was."""

from dataclasses import replace

import numpy as np
import pytest

from airtouch.gap.answer.unexplained import unexplained
from airtouch.gap.diagnosis import diagnose_with_study
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.judge import judge
from airtouch.gap.evidence.problem import whole_of
from airtouch.gap.flights import flight
from airtouch.gap.naming.policy import PASSING_GAIN
from airtouch.gap.naming.select import select
from airtouch.gap.passing import gate_search, gates
from airtouch.gap.signals.channels import inside, residual, share_inside
from airtouch.gap.signatures import candidates
from airtouch.gap.signatures.scatter import size_of
from airtouch.gap.signatures.signature import PASSING
from airtouch.gap.where.cell import Cell
from airtouch.logs.flight_log import PWM, FlightLog
from airtouch.simulation import effects
from airtouch.simulation.effects import Active
from gap_flights import LOOP, VEHICLE, fly

FROM_S, TO_S = 9.0, 15.0


@pytest.fixture(scope="module")
def nominal_flight():
    return fly(1, 62)[0]


def pushed(nominal, share):
    """A flight that something presses down between FROM_S and TO_S, by a share of its weight."""
    t = np.arange(len(nominal)) * flight.PERIOD_S
    force = nominal.acceleration.copy()
    force[(t >= FROM_S) & (t < TO_S), 2] -= share * VEHICLE.gravity_mps2
    return replace(nominal, acceleration=force)


def test_a_wake_is_found_with_its_seconds(study, nominal_flight):
    data = Data(study, [pushed(nominal_flight, 0.1)])
    strongest = max(gates.passing_effects(data).values(), key=lambda g: g.gain)
    assert strongest.gain > 100.0
    acts = inside(strongest.fitted.terms[0].gate, nominal_flight)
    t = np.arange(len(nominal_flight)) * flight.PERIOD_S
    true = (t >= FROM_S) & (t < TO_S)
    assert (acts & true).sum() > 0.7 * true.sum()
    assert (acts & ~true).sum() * flight.PERIOD_S < 3.0  # blocks last 2.56 s


def test_a_short_smooth_push_is_found_with_its_strength(study, nominal_flight):
    """A bell of 0.3 of the weight, 0.3 s wide at half its height, as of a wake that is flown through.

    A gate with hard edges has a spectrum of its own above the bell's, so that hardly any strength fits.
    """
    t = np.arange(len(nominal_flight)) * flight.PERIOD_S
    force = nominal_flight.acceleration.copy()
    force[:, 2] -= 0.3 * VEHICLE.gravity_mps2 * np.exp(-4.0 * np.log(2.0) * ((t - 12.0) / 0.3) ** 2)
    wake = gates.passing_effects(Data(study, [replace(nominal_flight, acceleration=force)]))["downwash"]
    (_, begin_s, end_s), = wake.fitted.terms[0].gate
    assert wake.gain > 100.0 and begin_s < 12.0 < end_s and end_s - begin_s < 0.6
    assert wake.fitted.terms[0].values["strength"] == pytest.approx(0.3, rel=0.25)


def test_a_nominal_flight_has_no_passing_effect(study, nominal_flight):
    for name, gated in gates.passing_effects(Data(study, [nominal_flight])).items():
        rate = gated.gain / (len(nominal_flight) * flight.PERIOD_S)
        assert gated.gain < PASSING_GAIN or study.scatter.unusual({name: size_of(rate, gated.strength)}) < 0.0


def test_the_diagnosis_says_when(study):
    """A wake that stands in the way, flown through twice in the simulator: its seconds are those near its axis."""
    wake = {"strength": 0.1, "x": 1.5, "y": 0.0, "width": 0.3, "turbulence": 1.0, "swirl": 0.01}
    (one,) = fly(1, 62, (("downwash", wake),))
    diagnosis = diagnose_with_study(study, [one], LOOP)
    assert [e.name for e in diagnosis.effects] == ["downwash"]
    seconds = diagnosis.effects[0].seconds
    t, near = np.arange(len(one)) * flight.PERIOD_S, np.abs(one.log["x_m"] - wake["x"]) < wake["width"]
    inside_gate = np.any([(t >= start) & (t < end) for _, start, end in seconds], axis=0)
    assert len(seconds) == 2 and all(name == one.name for name, _, _ in seconds)
    assert (inside_gate & near).sum() > 0.7 * near.sum()
    assert (inside_gate & ~near).sum() * flight.PERIOD_S < 3.0  # blocks last 2.56 s
    fields = next(e for e in diagnosis.plain()["effects"] if "seconds" in e)
    first = fields["seconds"][0]
    assert (first["from_s"], first["to_s"]) == pytest.approx(seconds[0][1:], abs=0.01)


def test_commands_that_are_livelier_than_the_floor_are_no_gain_of_a_passing_effect(study, nominal_flight):
    """Its random force cannot be seen in the commands, so nothing may be gained by being less sure of their floor."""
    calm = replace(study, loop=replace(study.loop, floor=0.2 * study.loop.floor))
    t = np.arange(len(nominal_flight)) * flight.PERIOD_S
    burst = ((t >= FROM_S) & (t < FROM_S + 2.0)) * np.random.default_rng(4).normal(size=len(t))
    acceleration = nominal_flight.acceleration + burst[:, None] * [0.0, 0.0, 0.5]
    data = Data(calm, [replace(nominal_flight, acceleration=acceleration)])
    level = [judge(data, whole_of(data), (), uncertain_floor) for uncertain_floor in (False, True)]
    assert level[1] - level[0] > 100.0  # else this flight tests nothing
    assert gates.passing_effects(data)["gust"].gain < 12.0  # it pushes sideways, the burst upwards


def test_a_wake_that_fills_the_flight_is_not_noise_of_the_motors(study):
    wake = {"strength": 0.03, "width": 0.0, "turbulence": 1.0, "turbulence_time": 0.02, "swirl": 0.01}
    assert diagnose_with_study(study, fly(1, 906, (("downwash", wake),)), LOOP).effects[0].name == "downwash"
    noise = {"rms": 0.02, "time": 0.02, "fast": 0.0, "fast_time": 0.01}
    effect = diagnose_with_study(study, fly(1, 904, (("motor_noise", noise),)), LOOP).effects[0]
    assert effect.name == "motor_noise"
    assert effect.parameters["rms"].value == pytest.approx(0.02, rel=0.1)


def test_what_adds_most_to_the_others_is_told_first(study, nominal_flight):
    both = pushed(nominal_flight, 0.06)
    both = replace(both, rates=both.rates + np.array([0.0, 0.05, 0.0]))
    selection = select(Data(study, [both]), candidates.all_candidates(LOOP))
    shares = {s.name: s.leave_one_out_gain for s in selection.named_steps}
    assert set(shares) == {"downwash", "imu_bias"}
    assert [s.name for s in selection.named_steps] == sorted(shares, key=lambda n: -shares[n])
    assert all(share > 12.0 for share in shares.values())


def test_samples_in_which_legs_may_touch_are_nobodys(nominal_flight):
    n = 800
    z = np.r_[np.full(100, 0.05), np.linspace(0.05, 0.4, 100), np.full(600, 0.4)]
    z[500:510] = 0.052
    log = FlightLog({"t_s": np.arange(n) * 0.01, **{m: np.where(z > 0.0501, 40000.0, 0.0) for m in PWM},
                     "acc_x_mps2": np.zeros(n), "acc_y_mps2": np.zeros(n), "acc_z_mps2": np.full(n, 9.81), "z_m": z},
                    {"source": "made"})
    landed = flight.ready(log, VEHICLE)
    assert list(np.flatnonzero(landed.touching[300:])) == list(range(195, 215))
    assert not landed.touching[:90].any()


def test_far_from_its_gate_an_effect_changes_nothing_and_within_it_is_as_if_it_always_acted(nominal_flight):
    effect = effects.get("downwash")
    values = effect.values({"strength": 0.3, "width": 0.0, "turbulence": 0.0})
    gated = Active(effect, values, ((nominal_flight.name, FROM_S, TO_S),))
    before, after = (residual(nominal_flight, VEHICLE, a) for a in ((), (gated,)))
    always = residual(nominal_flight, VEHICLE, (Active(effect, values),))
    share = share_inside(gated.gate, nominal_flight)
    on, off = share == 1.0, share == 0.0
    np.testing.assert_array_equal(after[off], before[off])
    np.testing.assert_allclose(after[on], always[on], atol=1e-9)
    assert np.abs(after[on, 2] - before[on, 2]).min() > 0.2 * VEHICLE.gravity_mps2


def test_a_wake_of_some_width_pushes_under_its_axis_only():
    from airtouch.simulation import replay
    from airtouch.simulation import signals as at
    effect = effects.get("downwash")
    active = Active(effect, effect.values({"strength": 0.25, "x": 1.0, "width": 0.1, "turbulence": 0.0}))
    s = np.zeros((3, at.COUNT))
    s[:, at.STEP], s[:, at.MASS], s[:, at.GRAVITY] = 0.01, 0.034, 9.81
    s[:, at.ROTATION], s[:, at.ROTATION + 4], s[:, at.ROTATION + 8] = 1.0, 1.0, 1.0
    s[:, at.POSITION] = 1.0, 1.1, 2.0
    lift = replay.wrench_of(active, s)[:, 2] / (0.034 * 9.81)
    np.testing.assert_allclose(lift, [-0.25, -0.25 / np.e, 0.0], atol=1e-9)


def test_every_gated_effect_is_one_of_the_registry():
    assert set(candidates.passing_variants()) == set(PASSING) <= set(effects.EFFECTS)
    assert "wind" not in candidates.passing_variants(["wind"])


def test_what_stays_open_is_shown_with_its_seconds(study, nominal_flight):
    rng = np.random.default_rng(3)
    t = np.arange(len(nominal_flight)) * flight.PERIOD_S
    on = (t >= FROM_S) & (t < TO_S)
    force = nominal_flight.acceleration.copy()
    force[on, 1] += 1.5 * np.sin(2.0 * np.pi * 4.0 * t[on]) + 0.1 * rng.normal(size=on.sum())
    odd = replace(nominal_flight, acceleration=force)
    selection = select(Data(study, [odd]), {}, without=tuple(PASSING))
    cell = Cell("force_y", (2.0, 6.0), "cruise", 0.5, 0.1, "m/s^2")
    first, = unexplained(study, [odd], selection, [cell])
    assert (first.channel, first.flight) == ("force_y", nominal_flight.name)
    assert FROM_S - 2.0 < first.from_s < first.to_s < TO_S + 2.0
    assert first.over_floor > 3.0


def test_no_effect_passes_in_take_off_and_landing(study, nominal_flight):
    ends = np.isin(nominal_flight.phase, gate_search.ENDS)
    assert ends.sum() * flight.PERIOD_S > 1.0
    force = nominal_flight.acceleration.copy()
    force[ends, 2] -= 0.1 * VEHICLE.gravity_mps2
    for gated in gates.passing_effects(Data(study, [replace(nominal_flight, acceleration=force)])).values():
        acts = inside(gated.fitted.terms[0].gate, nominal_flight)
        assert (acts & ends).sum() <= 0.5 * acts.sum()
