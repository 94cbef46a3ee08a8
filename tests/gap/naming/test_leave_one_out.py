"""What each of several effects adds to the others, by its definition: the gain of all, less that of all but one."""

from dataclasses import replace

import pytest

from airtouch.gap.evidence.data import Data
from airtouch.gap.naming import judging
from airtouch.gap.naming.leave_one_out import with_leave_one_out_gains
from airtouch.gap.naming.records import Step
from airtouch.gap.nominal.build_study import declared_study
from airtouch.gap.signatures.candidates import all_candidates
from gap_flights import VEHICLE, fly
from hovers import FLOOR, weak

LATE, BIAS, NOISE = ("sensor_latency", 0), ("imu_bias", 0), ("imu_noise", 0)
COST = {LATE: 0.5, BIAS: 1.0, NOISE: 2.0}  #: nats that the choice of each effect's variant costs


@pytest.fixture(scope="module")
def late():
    """A flight with late sensors and a biased accelerometer, on a vehicle whose loop is modelled."""
    flown = fly(1, 2, {"sensor_latency": {"delay": 0.008}, "imu_bias": {"acc_x": 0.1}})
    return judging.trial_of(Data(declared_study(VEHICLE, fly(4, 41)), flown))


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
def test_each_adds_the_gain_of_all_less_that_of_the_others(late, effects):
    """Late sensors gain more while no noise has made the commands' floor uncertain: nobody else adds that."""
    steps = added(late, *effects)
    assert steps[-1].charges.certainty_refund > 400.0
    for place, step in enumerate(with_leave_one_out_gains(late, steps)):
        assert step.leave_one_out_gain == pytest.approx(steps[-1].gain - gain_of_all_but(late, effects, place), abs=0.5)


def test_of_two_weak_rotors_one_is_left_without_the_other():
    on, effects = judging.trial_of(Data(FLOOR, [weak(r2=0.01, r3=0.02)])), (("weak_motor", 1), ("weak_motor", 2))
    steps = added(on, *effects)
    for place, step in enumerate(with_leave_one_out_gains(on, steps)):
        assert step.leave_one_out_gain == pytest.approx(steps[-1].gain - gain_of_all_but(on, effects, place), abs=0.3)
        assert step.leave_one_out_gain < 0.9 * steps[-1].gain


def test_an_effect_that_is_named_alone_and_a_deviation_have_none(late):
    latency, bias = added(late, LATE, BIAS)
    assert with_leave_one_out_gains(late, [latency, replace(bias, is_named=False)])[0].leave_one_out_gain is None
