"""What an effect must gain beside others, which of its variants is taken, and effects that only the loop shows."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from airtouch.gap import calibrate, judging
from airtouch.gap.candidates import every
from airtouch.gap.data import Data
from airtouch.simulation import effects
from gap_flights import VEHICLE, flown, noise
from hovers import DOWN, STIFF, chosen, found, made, own_gain, scattered


@pytest.fixture(scope="module")
def flying():
    """A vehicle as declared with the loop of four nominal flights; no scatter."""
    return calibrate.declared(VEHICLE, flown(4, 41))


def gains(selection):
    """What each step gains over those before it, by name."""
    so_far = [0.0, *(s.gain for s in selection.steps)]
    return {s.name: s.gain - before for s, before in zip(selection.steps, so_far, strict=False)}


def test_beside_an_effect_of_recorded_flights_another_must_gain_a_tenth_as_much():
    """A push, and noise a tenth above the floor: enough beside models that are exact, and not beside those of air."""
    one, names = [made(2, (0.0, 0.0, -DOWN), louder=1.1)], ("mass", "imu_noise")
    exact, _ = found(one, names, scattered(exact=True))
    assert [(s.name, s.named) for s in exact.steps] == [("mass", True), ("imu_noise", True)]
    factor = exact.chosen.terms[1].values["factor"]
    assert factor == pytest.approx(np.sqrt(2.0 * 1.1 ** 2 - 1.0), rel=0.03), "over the declared noise, half the floor"
    gained = gains(exact)
    assert judging.LEAST_GAIN < gained["imu_noise"] < 0.1 * gained["mass"]
    recorded, _ = found(one, names, scattered())
    assert [s.name for s in recorded.steps] == ["mass"]
    assert recorded.singles["imu_noise"].gain > judging.LEAST_GAIN, "alone it would do"


def test_an_effect_in_cells_of_its_own_is_held_against_what_is_gained_there():
    """Twice the noise everywhere, and a faint push that shows in the lowest band alone."""
    one, names = [made(2, (0.0, 0.0, -0.06), louder=2.0)], ("mass", "imu_noise")
    exact, _ = found(one, names, scattered(exact=True))
    assert [(s.name, s.named) for s in exact.steps] == [("imu_noise", True), ("mass", True)]
    gained = gains(exact)
    assert judging.LEAST_GAIN < gained["mass"] < 0.01 * gained["imu_noise"]
    recorded, _ = found(one, names, scattered())
    assert [s.name for s in recorded.steps] == ["imu_noise"]


@pytest.mark.parametrize("time_s", [0.005, 0.1])
def test_the_variant_of_a_random_effect_is_that_of_its_time(time_s):
    """First-order noise of the lift, as motors make it; the longer is no stronger than the shorter."""
    keep = np.exp(-0.01 / time_s)
    lift = 0.6 * lfilter([np.sqrt(1.0 - keep ** 2)], [1.0, -keep], noise(30.0, 1.0, 3)[:, 2])
    one = made(5)
    one = replace(one, acceleration=one.acceleration + lift[:, None] * [0.0, 0.0, 1.0])
    selection, _ = found([one], ("motor_noise",))
    (step,) = selection.steps
    assert step.terms[0].values["time"] == time_s and selection.assumed
    assert step.choice == pytest.approx(np.log(3.0)), "one of three times"
    # four motors of their own, each with a quarter of the weight
    assert step.terms[0].values["rms"] == pytest.approx(0.6 / VEHICLE.gravity_mps2 * 2.0, rel=0.25)


@pytest.mark.parametrize(("name", "parameter", "value"), [
    ("sensor_latency", "delay", 0.008), ("controller_gain", "rate", 0.6)])
def test_an_effect_of_the_loop_is_chosen_by_what_it_gains_in_the_commands(flying, name, parameter, value):
    selection, data = found(flown(1, 2, {name: {parameter: value}}), (name, "mass"), flying)
    (step,) = selection.steps
    assert step.name == name and step.named and selection.assumed and selection.nominal == 4
    assert step.terms[0].values[parameter] == pytest.approx(value, rel=0.2)
    assert set(selection.least.values()) == {judging.FIRST_GAIN}
    assert step.evidence == step.gain  # nothing is known of nominal flights' scatter
    free = len(step.terms[0].free)
    assert step.gain == pytest.approx(own_gain(data, step.terms) - (free - 1) * judging.PRICE - step.choice, rel=0.05)


def test_what_only_the_commands_show_is_fitted_though_a_first_look_sees_nothing(flying, tmp_path):
    file = tmp_path / "stiff_climb.py"
    file.write_text(STIFF, encoding="utf-8")
    effects.load_file(file)
    try:
        selection, _ = found(flown(1, 4, [("stiff_climb", {"factor": 2.5})]), ("stiff_climb", "mass"), flying)
    finally:
        effects.unregister("stiff_climb")
    (step,) = selection.steps
    assert step.name == "stiff_climb" and step.full and step.choice == 0.0
    assert step.terms[0].values["factor"] == pytest.approx(2.5, rel=0.35)


def test_a_thorough_look_has_the_strength_of_each_parameter_alone(flying):
    data = Data(flying, flown(1, 62))
    on = judging.trial_of(data)
    judged = judging.round_of(on, chosen(["controller_gain"]), None, thorough=True)["controller_gain"]
    _, *alone = every()["controller_gain"]
    assert judged.strength.shape == judged.variance.shape == (len(alone),) == (4,)
    for i, terms in enumerate(alone):
        tried = judging.crossed(on, "controller_gain", terms, None, np.log(len(alone)))
        assert judged.strength[i] == tried.strength[i] and judged.variance[i] == tried.variance[i]
        assert np.isinf(np.delete(tried.variance, i)).all() and not np.delete(tried.strength, i).any()
    assert judged.gain < judging.FIRST_GAIN, "a nominal flight"
