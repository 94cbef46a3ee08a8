"""What an effect must gain beside others, which of its variants is taken, and effects that only the loop shows."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from airtouch.gap.evidence.clock import loss
from airtouch.gap.evidence.data import Data
from airtouch.gap.naming import judging, policy, rounds
from airtouch.gap.naming.select import nameless_nats, select
from airtouch.gap.nominal.build_study import declared_study
from airtouch.gap.signatures.candidates import all_candidates
from airtouch.gap.signatures.scatter import Scatter
from airtouch.simulation import effects
from gap_flights import VEHICLE, fly, noise
from hovers import (
    ALWAYS,
    DOWN,
    FLOOR,
    LIFT_N,
    STIFF,
    candidates_of,
    hover,
    own_gain,
    scattered,
    select_from,
    swaying,
    weak,
)


@pytest.fixture(scope="module")
def flying():
    """A vehicle as declared with the loop of four nominal flights; no scatter."""
    return declared_study(VEHICLE, fly(4, 41))


def gains(selection):
    """What each step gains over those before it, by name."""
    so_far = [0.0, *(s.gain for s in selection.steps)]
    return {s.name: s.gain - before for s, before in zip(selection.steps, so_far, strict=False)}


def test_misfit_share_of_recorded_flights():
    """A push, and noise a tenth above the floor: enough beside models that are exact, and not beside those of air."""
    flights, names = [hover(2, (0.0, 0.0, -DOWN), louder=1.1)], ("mass", "imu_noise")
    exact, _ = select_from(flights, names, scattered(exact=True))
    assert [(s.name, s.is_named) for s in exact.steps] == [("mass", True), ("imu_noise", True)]
    factor = exact.named_hypothesis.terms[1].values["factor"]
    assert factor == pytest.approx(np.sqrt(2.0 * 1.1 ** 2 - 1.0), rel=0.03), "over the declared noise, half the floor"
    added = gains(exact)
    assert policy.LEAST_GAIN < added["imu_noise"] < 0.1 * added["mass"]
    recorded, _ = select_from(flights, names, scattered())
    assert [s.name for s in recorded.steps] == ["mass"]
    assert recorded.single_effects["imu_noise"].gain > policy.LEAST_GAIN, "alone it would do"


def test_misfit_counts_in_improved_cells_of_simulated_flights():
    """Twice the noise everywhere, and a faint push that shows in the lowest band alone."""
    flights, names = [hover(2, (0.0, 0.0, -0.06), louder=2.0)], ("mass", "imu_noise")
    exact, _ = select_from(flights, names, scattered(exact=True))
    assert [(s.name, s.is_named) for s in exact.steps] == [("imu_noise", True), ("mass", True)]
    added = gains(exact)
    assert policy.LEAST_GAIN < added["mass"] < 0.01 * added["imu_noise"]
    recorded, _ = select_from(flights, names, scattered())
    assert [s.name for s in recorded.steps] == ["imu_noise"]


@pytest.mark.parametrize("time_s", [0.005, 0.1])
def test_variant_of_the_right_time_is_named(time_s):
    """First-order noise of the lift, as motors make it; the longer is no stronger than the shorter."""
    decay = np.exp(-0.01 / time_s)
    lift = 0.6 * lfilter([np.sqrt(1.0 - decay ** 2)], [1.0, -decay], noise(30.0, 1.0, 3)[:, 2])
    flight = hover(5)
    flight = replace(flight, acceleration=flight.acceleration + lift[:, None] * [0.0, 0.0, 1.0])
    selection, _ = select_from([flight], ("motor_noise",))
    (step,) = selection.steps
    assert step.terms[0].values["time"] == time_s and selection.assumed
    assert step.charges.choice_cost == pytest.approx(np.log(3.0)), "one of three times"
    # four motors of their own, each with a quarter of the weight
    assert step.terms[0].values["rms"] == pytest.approx(0.6 / VEHICLE.gravity_mps2 * 2.0, rel=0.25)


@pytest.mark.parametrize(("name", "parameter", "value"), [
    ("sensor_latency", "delay", 0.008), ("controller_gain", "rate", 0.6)])
def test_loop_effect_is_named_by_the_commands(flying, name, parameter, value):
    selection, data = select_from(fly(1, 2, {name: {parameter: value}}), (name, "mass"), flying)
    (step,) = selection.steps
    assert step.name == name and step.is_named and selection.assumed
    assert selection.policy.unknown.least == pytest.approx(12.0 * 5 / 3), "of four nominal flights"
    assert step.terms[0].values[parameter] == pytest.approx(value, rel=0.2)
    assert set(selection.least_nats.values()) == {policy.FIRST_GAIN}
    assert step.evidence == step.gain  # nothing is known of nominal flights' scatter
    free = len(step.terms[0].free)
    price = (free - 1) * policy.PRICE + step.charges.choice_cost
    assert step.gain == pytest.approx(own_gain(data, step.terms) - price, rel=0.05)


def test_effect_that_only_the_commands_show_is_fitted(flying, tmp_path):
    file = tmp_path / "stiff_climb.py"
    file.write_text(STIFF, encoding="utf-8")
    effects.load_file(file)
    try:
        selection, _ = select_from(fly(1, 4, [("stiff_climb", {"factor": 2.5})]), ("stiff_climb", "mass"), flying)
    finally:
        effects.unregister("stiff_climb")
    (step,) = selection.steps
    assert step.name == "stiff_climb" and step.full and step.charges.choice_cost == 0.0
    assert step.terms[0].values["factor"] == pytest.approx(2.5, rel=0.35)


def test_every_strength_has_each_parameter_alone(flying):
    data = Data(flying, fly(1, 62))
    on = judging.trial_of(data)
    best = rounds.every_strength(on, candidates_of(["controller_gain"]))["controller_gain"]
    together = best.strength
    _, *variants = all_candidates()["controller_gain"]
    assert together.mean.shape == together.variance.shape == (len(variants),) == (4,)
    for i, terms in enumerate(variants):
        variant = judging.PricedVariant("controller_gain", terms, np.log(len(variants)))
        single = judging.cross_validated(on, variant, None).strength
        assert together.mean[i] == single.mean[i] and together.variance[i] == single.variance[i]
        assert np.isinf(np.delete(single.variance, i)).all() and not np.delete(single.mean, i).any()
    assert best.gain < policy.FIRST_GAIN, "a nominal flight"


@pytest.mark.parametrize("rotor", [1, 2, 3, 4])
def test_weak_rotor_is_named_by_its_side(rotor):
    selection, _ = select_from([weak(**{f"r{rotor}": 0.002})], ("weak_motor",))
    (step,) = selection.steps
    assert step.terms[0].values["rotor"] == rotor
    assert step.terms[0].values["thrust_loss"] == pytest.approx(0.002, rel=0.1)


def test_two_weak_rotors():
    selection, _ = select_from([weak(r1=0.002, r2=0.005)], ("weak_motor",))
    first, second = selection.steps
    losses = {t.values["rotor"]: t.values["thrust_loss"] for t in selection.last_step.terms}
    assert losses == {2.0: pytest.approx(0.005, rel=0.1), 1.0: pytest.approx(0.002, rel=0.1)}
    assert first.terms[0].values["rotor"] == 2.0
    unit = losses[1.0] / second.terms[1].scaled(second.terms[1].values)[0]
    assert second.strength.mean[0] * unit == pytest.approx(0.002, rel=0.1), "its own, not the first one's"


def test_few_lost_rows_are_not_named():
    """What the log did to its own times has no cells in which it is held against the effect before it."""
    lost = np.zeros(3000, bool)
    lost[500:2900:200] = True
    selection, data = select_from([replace(hover(2, (0.0, 0.0, -DOWN)), lost=lost)], ("mass", "packet_loss"),
                                  scattered(exact=True))
    assert 0.0 < selection.single_effects["packet_loss"].gain < policy.LEAST_GAIN
    assert [s.name for s in selection.steps] == ["mass"]


def test_faint_push_beside_lost_rows_is_not_named():
    lost = np.random.default_rng(0).random(3000) < 0.1
    flight = replace(hover(2, (0.0, 0.0, -0.02)), lost=lost)
    selection, _ = select_from([flight], ("mass", "packet_loss"), scattered(exact=True))
    assert 0.0 < selection.single_effects["mass"].gain < policy.LEAST_GAIN
    assert [s.name for s in selection.steps] == ["packet_loss"]


def test_nameless_nats_include_the_times():
    data = Data(FLOOR, [replace(hover(2), lost=np.random.default_rng(0).random(3000) < 0.1)])
    on, (term,) = judging.trial_of(data), all_candidates()["packet_loss"][0]
    packet_loss = judging.cross_validated(on, judging.PricedVariant("packet_loss", (term,), 0.0), None)
    assert packet_loss.gain == pytest.approx(loss(data)[1]) and packet_loss.gain > 100.0
    assert nameless_nats(on, None) - nameless_nats(on, packet_loss) == pytest.approx(packet_loss.gain)


def test_leave_one_out_gain_after_six_parameters():
    selection, data = select_from([hover(1, (0.4, -0.3, -DOWN), louder=2.0)], ("imu_bias", "imu_noise"))
    shares = {s.name: s.leave_one_out_gain for s in selection.named_steps}
    (bias,) = (t for t in selection.last_step.terms if t.name == "imu_bias")
    bias_gain = own_gain(data, [bias]) - 5 * policy.PRICE
    assert shares["imu_noise"] == pytest.approx(selection.last_step.gain - bias_gain, abs=0.3)


def test_certainty_refund_is_given_back_once(flying):
    """By definition: what both gain, and what the first one gained while the commands' floor was sure."""
    data = Data(flying, fly(1, 2, {"sensor_latency": {"delay": 0.008}}))
    on = judging.trial_of(data)
    latency = judging.PricedVariant("sensor_latency", all_candidates()["sensor_latency"][0], 0.0)
    late = judging.cross_validated(on, latency, None)
    both = judging.cross_validated(on, judging.PricedVariant("imu_noise", all_candidates()["imu_noise"][0], 0.5), late)
    sure, unsure = (sum(judging.gain_of(on, 1 - k, late.fits[k].terms, wide) for k in (0, 1)) for wide in (False, True))
    joint_gain = sum(judging.gain_of(on, 1 - k, both.fits[k].terms) for k in (0, 1))
    assert sure - unsure > 5.0 and late.charges.certainty_refund == 0.0 and both.charges.choice_cost == 0.5
    assert both.charges.certainty_refund == pytest.approx(sure - unsure)
    assert both.gain == pytest.approx(joint_gain + (sure - unsure) - 0.5)
    third = judging.cross_validated(on, judging.PricedVariant("vibration", all_candidates()["vibration"][0], 0.0), both)
    assert third.charges.certainty_refund == both.charges.certainty_refund, "paid once"


@pytest.mark.parametrize("simulated", [True, False])
def test_changed_loop_is_assumed_in_recorded_flights(flying, simulated):
    study = replace(flying, scatter=Scatter({}, 8.0, (0.0, 0.0), exact=simulated))
    selection, _ = select_from(fly(1, 2, {"sensor_latency": {"delay": 0.008}}), ("sensor_latency",), study)
    assert [s.name for s in selection.steps] == ["sensor_latency"] and selection.assumed is not simulated


def test_lost_rows_add_no_misfit():
    """Of a tenth that another effect must gain in recorded flights, lost rows count for nothing."""
    lost = np.random.default_rng(0).random(3000) < 0.1
    flight = replace(hover(2, (0.0, 0.0, -0.1), louder=1.25), lost=lost)
    names_reported, names = [], ("mass", "imu_noise", "packet_loss")
    selection, _ = select_from([flight], names, scattered(), progress=names_reported.append)
    assert [s.name for s in selection.steps] == ["packet_loss", "mass", "imu_noise"]
    added = gains(selection)
    assert 0.1 * added["mass"] < added["imu_noise"] < 0.1 * (added["mass"] + added["packet_loss"])
    assert names_reported.count("imu_noise") >= 3, "told in every round"


@pytest.mark.parametrize(("louder", "loss", "first"), [(2.0, 0.002, "imu_noise"), (2.0, 0.01, "weak_motor")])
def test_leave_one_out_gain_pays_for_the_choice(louder, loss, first):
    """One of four rotors is chosen, whether it is the first effect found or the second."""
    selection, data = select_from([weak(louder=louder, r2=loss)], ("weak_motor", "imu_noise"))
    assert selection.steps[0].name == first
    shares = {s.name: s.leave_one_out_gain for s in selection.named_steps}
    assert set(shares) == {"weak_motor", "imu_noise"}
    of = {t.name: t for t in selection.last_step.terms}
    assert selection.last_step.gain == pytest.approx(own_gain(data, selection.last_step.terms) - np.log(4.0), abs=0.3)
    assert shares["weak_motor"] == pytest.approx(selection.last_step.gain - own_gain(data, [of["imu_noise"]]), abs=0.3)
    rotor_alone = own_gain(data, [of["weak_motor"]]) - np.log(4.0)
    assert shares["imu_noise"] == pytest.approx(selection.last_step.gain - rotor_alone, abs=0.3)


def test_leave_one_out_gain_includes_the_companion():
    """Gusts with drag, and a push: without the gusts their drag goes as well, without the push both stay."""
    flight = swaying(drag=0.02, gust_mps2=0.1)
    pushed = replace(flight, acceleration=flight.acceleration - [0.0, 0.0, DOWN])
    selection, data = select_from([pushed], ("gust", "mass"), scattered(exact=True))
    shares = {s.name: s.leave_one_out_gain for s in selection.named_steps}
    gust, drag, mass = selection.last_step.terms
    assert (gust.name, drag.name, mass.name) == ("gust", "rotor_drag", "mass") and drag.companion
    assert shares["gust"] == pytest.approx(selection.last_step.gain - own_gain(data, [mass]), abs=0.3)
    of_gust = own_gain(data, [gust, drag]) - policy.PRICE - np.log(3.0)  # a second axis of drag, one of three lengths
    assert shares["mass"] == pytest.approx(selection.last_step.gain - of_gust, abs=0.3)


def test_leave_one_out_keeps_an_effect_of_the_companions_name():
    """Gusts that have no drag beside them, and the rotors' drag: what gusts add is all but what the drag gains."""
    without_companion = all_candidates(without=("rotor_drag",))["gust"]
    data = Data(scattered(exact=True), [swaying(drag=0.02, gust_mps2=0.1)])
    selection = select(data, {**candidates_of(["rotor_drag"]), "gust": without_companion}, without=ALWAYS)
    shares = {s.name: s.leave_one_out_gain for s in selection.named_steps}
    assert set(shares) == {"gust", "rotor_drag"} and not any(t.companion for t in selection.last_step.terms)
    drag = [t for t in selection.last_step.terms if t.name == "rotor_drag"]
    of_drag = own_gain(data, drag) - policy.PRICE  # a second axis of drag
    assert shares["gust"] == pytest.approx(selection.last_step.gain - of_drag, abs=0.5), "a fit that began elsewhere"


def test_clock_and_spectra_are_judged_apart():
    """The log's times and its forces are judged apart."""
    lost = np.random.default_rng(0).random(3000) < 0.1
    selection, data = select_from([replace(hover(2, (0.0, 0.0, -DOWN)), lost=lost)], ("mass", "packet_loss"),
                                  scattered(exact=True))
    shares = {s.name: s.leave_one_out_gain for s in selection.named_steps}
    mass = [t for t in selection.last_step.terms if t.name == "mass"]
    assert shares == {"mass": pytest.approx(own_gain(data, mass)), "packet_loss": pytest.approx(loss(data)[1])}


@pytest.mark.parametrize(("louder", "named"), [(1.2, False), (1.25, True)])
def test_random_effect_is_named_from_a_quarter_of_the_gain(louder, named):
    """A model that is wrong looks random: noise that gains less stands there without a name."""
    selection, _ = select_from([hover(2, (0.0, 0.0, -DOWN), louder=louder)], ("mass", "imu_noise"), scattered())
    added = gains(selection)
    assert [(s.name, s.is_named) for s in selection.steps] == [("mass", True), ("imu_noise", named)]
    assert (added["imu_noise"] > 0.25 * added["mass"]) == named and added["imu_noise"] > 0.1 * added["mass"]


@pytest.mark.parametrize("nominal_loss", [True, False])
def test_three_deviations_then_evidence_alone(nominal_loss):
    """Four effects: lost rows, which gain least, where nominal flights lose as many as well, and where none does."""
    flight = weak(r2=0.004, louder=1.3)
    flight = replace(flight, acceleration=flight.acceleration - [0.0, 0.0, DOWN],
                     lost=np.random.default_rng(0).random(2000) < 0.02)
    rms = {"mass": [3.0], "weak_motor": [30.0], "imu_noise": [30.0], "packet_loss": [30.0]}
    study = scattered(**{n: r for n, r in rms.items() if n != "packet_loss" or nominal_loss})
    selection, _ = select_from([flight], tuple(rms), study)
    names = ["weak_motor", "mass", "imu_noise"] + ["packet_loss"] * (not nominal_loss)
    assert [(s.name, s.is_named) for s in selection.steps] == [(n, n == "packet_loss") for n in names]
    beside = {n: [t.name for t in j.terms] for n, j in selection.single_effects.items()}
    assert beside["weak_motor"] == names[:1] and beside["mass"] == names[:2] and beside["imu_noise"] == names[:3]
    assert beside["packet_loss"] == [*names[:2 if nominal_loss else 3], "packet_loss"], "as judged before the last step"


def test_halves_that_differ_lower_the_evidence():
    """Four flights of the same mean push: alike, or 1.0 and 0.4 m/s^2 in turns."""
    def pushed(*amounts):
        return [hover(20 + k, (0.0, 0.0, -a), length_s=10.0) for k, a in enumerate(amounts)]

    alike, apart = pushed(0.7, 0.7, 0.7, 0.7), pushed(1.0, 0.4, 1.0, 0.4)
    (sure,), (doubted,) = (select_from(f, ("imu_bias",))[0].steps for f in (alike, apart))
    unit = 0.1  # m/s^2, the parameter's step
    assert doubted.strength.mean[2] == pytest.approx(sure.strength.mean[2], rel=0.02)
    assert sure.strength.mean[2] == pytest.approx(-0.7 / unit, rel=0.02)
    # the mean of two values that lie 0.6 apart
    assert doubted.strength.variance[2] == pytest.approx((0.6 / unit) ** 2 / 4.0, rel=0.05)
    assert sure.strength.variance[2] < 0.01 * doubted.strength.variance[2]

    (mass,) = select_from(alike, ("mass",))[0].steps
    nominal = scattered(mass=[abs(mass.strength.mean[0]) / 8.0])
    (evident,), (deviation,) = (select_from(f, ("mass",), nominal)[0].steps for f in (alike, apart))
    # Student's density of 8 degrees of freedom, 8 deviations out; the other counts as far as both halves have it
    assert evident.evidence == pytest.approx(4.5 * np.log1p(8.0 ** 2 / 8.0), rel=0.05) and evident.is_named
    weak, between = (a / (4.0 * LIFT_N / VEHICLE.mass_kg - a) for a in (0.4, 0.7))  # shares of the mass
    assert deviation.evidence == pytest.approx(4.5 * np.log1p((8.0 * weak / between) ** 2 / 8.0), rel=0.1)
    assert not deviation.is_named
    assert deviation.gain > policy.LEAST_GAIN


def test_turbulent_ground_effect_is_named(flying):
    shaking = {"ground_effect": {"strength": 0.8, "fade": 0.0875, "turbulence": 1.0}}
    selection, _ = select_from(fly(1, 12, shaking), ("ground_effect", "mass"), flying)
    first = selection.steps[0]
    assert first.name == "ground_effect" and first.terms[0].values["strength"] == pytest.approx(0.8, rel=0.35)
