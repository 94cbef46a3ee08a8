"""What each of several effects adds to the others, by its definition: the gain of all, less that of all but one."""

from dataclasses import replace

import numpy as np
import pytest

from airtouch.gap.evidence.clock import loss
from airtouch.gap.evidence.data import Data
from airtouch.gap.naming import judging, policy
from airtouch.gap.naming.leave_one_out import with_leave_one_out_gains
from airtouch.gap.naming.records import Step
from airtouch.gap.naming.select import select
from airtouch.gap.signatures.candidates import all_candidates
from gap_flights import fly
from hovers import ALWAYS, DOWN, FLOOR, candidates_of, hover, own_gain, scattered, select_from, swaying, weak

LATE, BIAS, NOISE = ("sensor_latency", 0), ("imu_bias", 0), ("imu_noise", 0)
COST = {LATE: 0.5, BIAS: 1.0, NOISE: 2.0}  #: nats that the choice of each effect's variant costs


@pytest.fixture(scope="module")
def late(flying):
    """A flight with late sensors and a biased accelerometer, on a vehicle whose loop is modelled."""
    flown = fly(1, 2, {"sensor_latency": {"delay": 0.007}, "imu_bias": {"acc_x": 0.1}})
    return judging.trial_of(Data(flying, flown))


def added(on, *effects):
    """The steps of effects that are added one after another, all of them named. effects: name and variant."""
    steps = []
    for name, variant in effects:
        terms = all_candidates()[name][variant]
        priced = judging.PricedVariant(name, terms, COST.get((name, variant), 0.0))
        steps.append(Step.of(judging.cross_validated(on, priced, steps[-1] if steps else None)))
    return steps


def gain_of_all_but(on, effects, place):
    """Gain of the others, added in the same order as if nobody had known that effect."""
    return added(on, *(e for i, e in enumerate(effects) if i != place))[-1].gain


@pytest.mark.parametrize("effects", [(LATE, NOISE, BIAS), (LATE, BIAS, NOISE), (BIAS, LATE, NOISE)])
def test_gain_is_that_of_all_less_that_of_the_others(late, effects):
    """Late sensors gain more while no noise has made the commands' floor uncertain: nobody else adds that."""
    steps = added(late, *effects)
    assert steps[-1].charges.uncertain_floor_loss > 100.0
    for place, step in enumerate(with_leave_one_out_gains(late, steps)):
        assert step.leave_one_out_gain == pytest.approx(steps[-1].gain - gain_of_all_but(late, effects, place), abs=0.5)


def test_gain_of_each_of_two_weak_rotors():
    on, effects = judging.trial_of(Data(FLOOR, [weak(r2=0.01, r3=0.02)])), (("weak_motor", 1), ("weak_motor", 2))
    steps = added(on, *effects)
    for place, step in enumerate(with_leave_one_out_gains(on, steps)):
        assert step.leave_one_out_gain == pytest.approx(steps[-1].gain - gain_of_all_but(on, effects, place), abs=0.3)
        assert step.leave_one_out_gain < 0.9 * steps[-1].gain


def test_single_named_effect_has_no_gain(late):
    latency, bias = added(late, LATE, BIAS)
    assert with_leave_one_out_gains(late, [latency, replace(bias, is_named=False)])[0].leave_one_out_gain is None


def test_leave_one_out_gain_after_six_parameters():
    selection, data = select_from([hover(1, (0.4, -0.3, -DOWN), louder=2.0)], ("imu_bias", "imu_noise"))
    shares = {s.name: s.leave_one_out_gain for s in selection.named_steps}
    (bias,) = (t for t in selection.last_step.terms if t.name == "imu_bias")
    bias_gain = own_gain(data, [bias]) - 5 * policy.PRICE
    assert shares["imu_noise"] == pytest.approx(selection.last_step.gain - bias_gain, abs=0.3)


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
