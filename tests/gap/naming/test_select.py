"""Selection on made flights whose truth is known: white noise of the declared sensors, and what a test injects."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from airtouch.gap.evidence.clock import loss, measured_clock_term
from airtouch.gap.evidence.data import Data
from airtouch.gap.naming import judging, policy, rounds
from airtouch.gap.naming.select import nameless_nats, select
from airtouch.gap.naming.unknown import is_explained
from airtouch.gap.signatures.candidates import all_candidates
from airtouch.gap.signatures.scatter import Scatter
from gap_flights import VEHICLE, fly, noise
from hovers import DOWN, FLOOR, LOUDNESS, candidates_of, hover, own_gain, scattered, select_from, weak

#: those that were taken for one of a pair, and the pairs' own
CANDIDATES = ("actuator_delay", "com_offset", "controller_gain", "imu_bias", "imu_noise", "inertia", "motor_lag",
              "motor_noise", "sensor_latency", "thrust_coefficient", "vibration", "wind")


@pytest.fixture(scope="module")
def heavy():
    names = ("mass", "thrust_coefficient", "imu_bias", "rotor_drag", "weak_motor")
    return select_from([hover(1, (0.0, 0.0, -DOWN))], names)


def test_nominal_flight_has_no_effect():
    names_reported = []
    names = ("mass", "imu_bias", "rotor_drag", "wind", "imu_noise", "weak_motor")
    selection, _ = select_from([hover(1)], names, progress=names_reported.append)
    assert selection.steps == () and selection.named_hypothesis is None and is_explained(selection)
    assert set(names_reported) == set(selection.single_effects) == set(names) == set(selection.least_nats)
    assert set(selection.least_nats.values()) == {policy.LEAST_GAIN}  # without a loop the stricter one
    assert selection.nameless.over_none == selection.nameless.over_last_step < 12.0
    assert not any(j.full for j in selection.single_effects.values())
    assert not selection.spectrum_is_assumed and selection.policy.unknown.nominal_gain == 0.0
    drag, motor = selection.single_effects["rotor_drag"], selection.single_effects["weak_motor"]
    # a vehicle that stands in the air has no drag: two parameters that do nothing cost the price of one
    assert drag.gain == pytest.approx(-policy.PRICE) and drag.charges.choice_cost == 0.0
    assert motor.charges.choice_cost == pytest.approx(np.log(4.0)), "one of four rotors"
    assert selection.single_effects["wind"].charges.choice_cost == pytest.approx(np.log(2.0))


def test_push_is_named_once(heavy):
    """A mass and a loss of thrust are one push of a vehicle that hovers: chance decides which of them is named."""
    selection, data = heavy
    (step,) = selection.steps
    mass, thrust = (selection.single_effects[name] for name in ("mass", "thrust_coefficient"))
    assert step.name in (mass.name, thrust.name) and mass.gain == pytest.approx(thrust.gain, abs=0.5)
    assert step.is_named and step.full and step.evidence == step.gain
    loss = thrust.terms[0].values["loss"]
    assert mass.terms[0].values["fraction"] == pytest.approx(loss / (1.0 - loss), rel=0.03)
    bias = selection.single_effects["imu_bias"]
    assert bias.terms[0].values["acc_z"] == pytest.approx(-DOWN, rel=0.03)
    assert bias.strength.mean[2] == pytest.approx(-DOWN / 0.1, rel=0.03) and bias.strength.variance.shape == (6,)
    assert np.abs(bias.strength.mean[:2]).max() < 0.1
    # the variance of the mean of white noise of twice the declared power, in the unit of the parameter
    true = LOUDNESS * VEHICLE.acc_noise_rms_mps2 * VEHICLE.acc_noise_ratio[2] / 0.1 / np.sqrt(3000)
    assert 0.5 * true < np.sqrt(bias.strength.variance[2]) < 4.0 * true
    assert step.gain == pytest.approx(own_gain(data, step.terms), rel=0.01), "one parameter costs nothing"
    assert bias.gain == pytest.approx(own_gain(data, bias.terms) - 5 * policy.PRICE, abs=2.0)
    nameless = selection.nameless
    assert nameless.over_none > 0.9 * step.gain and nameless.over_last_step < 12.0 and is_explained(selection)
    assert selection.named_hypothesis.terms == step.terms


def test_deviation_is_not_named():
    selection, _ = select_from([hover(2, (0.0, 0.0, -DOWN), louder=2.0)], ("mass", "imu_noise"), scattered(mass=[3.0]))
    assert [(s.name, s.is_named) for s in selection.steps] == [("imu_noise", True), ("mass", False)]
    assert selection.steps[1].evidence < 1.0 < policy.LEAST_GAIN < selection.steps[1].gain - selection.steps[0].gain
    assert [s.name for s in selection.named_steps] == ["imu_noise"]
    # four times a floor of twice the declared power; the declared one itself is no part of what is added
    assert selection.named_hypothesis.terms[0].values["factor"] == pytest.approx(np.sqrt(2.0 * 4.0 - 1.0), rel=0.03)
    assert [t.name for t in selection.named_hypothesis.terms] == ["imu_noise"]
    assert {t.name for t in selection.last_step.terms} == {"imu_noise", "mass"} and selection.spectrum_is_assumed
    push_only, _ = select_from([hover(2, (0.0, 0.0, -DOWN))], ("mass",), scattered(mass=[3.0]))
    assert [s.is_named for s in push_only.steps] == [False] and push_only.named_hypothesis is None
    assert is_explained(push_only)
    assert push_only.policy.unknown.nominal_gain == pytest.approx(12.0), "of a rate of 0"


def test_rarer_of_two_equal_gains_is_named():
    flights = [hover(1, (0.0, 0.0, -DOWN))]
    selection, _ = select_from(flights, ("mass", "imu_bias"), scattered(mass=[3.0], imu_bias=[0.001] * 6))
    assert [s.name for s in selection.named_steps] == ["imu_bias"]
    assert selection.single_effects["mass"].gain > selection.single_effects["imu_bias"].gain
    selection, _ = select_from(flights, ("mass", "imu_bias"), scattered(mass=[0.001], imu_bias=[0.001] * 6))
    assert [s.name for s in selection.named_steps] == ["mass"]


def test_effect_at_its_bound_is_not_named():
    selection, _ = select_from([hover(3, (0.0, 0.0, -8.0))], ("mass",))
    (step,) = selection.steps
    assert step.terms[0].values["fraction"] == 1.0 and step.evidence == 0.0 and not step.is_named
    assert selection.named_hypothesis is None and not is_explained(selection)


def test_three_effects_are_named_with_their_gains():
    """Noise of twice the rms; one row in ten lost; and a push: three effects, each found beside the others."""
    lost = np.random.default_rng(0).random(3000) < 0.1
    flight = replace(hover(4, (0.0, 0.0, -DOWN), louder=2.0), lost=lost)
    names = ("mass", "imu_noise", "packet_loss")
    selection, data = select_from([flight], names)
    assert {s.name for s in selection.named_steps} == set(names) and selection.named_steps[-1].name == "packet_loss"
    share = next(t for t in selection.last_step.terms if t.name == "packet_loss").values["share"]
    assert share == pytest.approx(lost.mean(), rel=0.1)
    by_name = {s.name: s.leave_one_out_gain for s in selection.named_steps}
    lost_alone = measured_clock_term(data, candidates_of(["packet_loss"])["packet_loss"][0][0]).gain
    assert by_name["packet_loss"] == pytest.approx(lost_alone, rel=1e-3)
    gains = [s.gain for s in selection.steps]
    assert gains == sorted(gains)
    assert by_name["mass"] > 100.0 and by_name["imu_noise"] > 500.0
    noise_only = own_gain(data, [t for t in selection.last_step.terms if t.name == "imu_noise"])
    of_clock = by_name["packet_loss"]
    assert by_name["mass"] == pytest.approx(gains[-1] - of_clock - noise_only, rel=0.02)


def test_most_effects_limits_the_names(monkeypatch):
    assert policy.MOST_EFFECTS == 3
    monkeypatch.setattr("airtouch.gap.naming.forward.MOST_EFFECTS", 2)
    lost = np.random.default_rng(0).random(3000) < 0.1
    selection, _ = select_from([replace(hover(4, (0.0, 0.0, -DOWN), louder=2.0), lost=lost)],
                               ("mass", "imu_noise", "packet_loss"))
    assert {s.name for s in selection.named_steps} == {"imu_noise", "packet_loss"}, "the two that gain most"


def test_every_strength_fits_every_random_effect():
    on, candidates = judging.trial_of(Data(FLOOR, [hover(7)])), candidates_of(["imu_noise", "mass"])
    for full, best in ((False, rounds.round_of(on, candidates, None)), (True, rounds.every_strength(on, candidates))):
        assert best["imu_noise"].full == full
        assert best["imu_noise"].gain < policy.HOPELESS and best["imu_noise"].strength.mean[0] < 0.05


def test_seconds_are_those_of_all_flights():
    assert Data(FLOOR, [hover(1), hover(2, length_s=10.0)]).seconds == pytest.approx(40.0)


def test_candidates_beside_a_base():
    data = Data(FLOOR, [hover(1, (0.0, 0.0, -DOWN))])
    on = judging.trial_of(data)
    candidates = candidates_of(["mass", "thrust_coefficient", "weak_motor", "imu_noise"])
    mass = rounds.round_of(on, candidates, None)["mass"]
    beside = rounds.round_of(on, candidates, mass)
    assert set(beside) == {"weak_motor", "imu_noise"}
    for candidate in beside.values():
        assert candidate.terms[0].name == "mass" and candidate.gain < mass.gain + 12.0
        assert candidate.evidence == pytest.approx(candidate.gain - mass.gain)
    dearer = judging.cross_validated(on, judging.PricedVariant("mass", mass.terms, 0.5), None)
    assert dearer.gain == pytest.approx(mass.gain - 0.5) and dearer.charges.choice_cost == 0.5
    motor = candidates_of(["weak_motor"])["weak_motor"][0]
    both = judging.cross_validated(on, judging.PricedVariant("weak_motor", motor, 0.25), dearer)
    assert both.charges.choice_cost == 0.75 and [t.name for t in both.terms] == ["mass", "weak_motor"]
    gain = own_gain(data, [*dearer.terms, *motor], [np.append(f.scaled, 0.0) for f in dearer.fits])
    assert both.gain == pytest.approx(gain - 0.75, abs=0.1)


def simulated(**rms):
    """A study of flights that come from the models which effects are fitted with."""
    return FLOOR.with_scatter(Scatter({n: np.array(r) for n, r in rms.items()}, 8.0, (0.0, 0.0), exact=True))


def test_calm_is_a_gap_in_simulated_flights():
    exact, nominal = (select_from([hover(3, louder=r)], ("mass",), simulated(mass=[1e-3]))[0] for r in (0.5, 1.0))
    recorded, _ = select_from([hover(3, louder=0.5)], ("mass",), scattered(mass=[1e-3]))
    assert recorded.nameless.over_none < 12.0 and exact.nameless.over_none > nominal.nameless.over_none + 100.0


@pytest.mark.parametrize("time_s", [0.005, 0.1])
def test_variant_of_the_right_time_is_named(time_s):
    """First-order noise of the lift, as motors make it; the longer is no stronger than the shorter."""
    decay = np.exp(-0.01 / time_s)
    lift = 0.6 * lfilter([np.sqrt(1.0 - decay ** 2)], [1.0, -decay], noise(30.0, 1.0, 3)[:, 2])
    flight = hover(5)
    flight = replace(flight, acceleration=flight.acceleration + lift[:, None] * [0.0, 0.0, 1.0])
    selection, _ = select_from([flight], ("motor_noise",))
    (step,) = selection.steps
    assert step.terms[0].values["time"] == time_s and selection.spectrum_is_assumed
    assert step.charges.choice_cost == pytest.approx(np.log(3.0)), "one of three times"
    # four motors of their own, each with a quarter of the weight
    assert step.terms[0].values["rms"] == pytest.approx(0.6 / VEHICLE.gravity_mps2 * 2.0, rel=0.25)


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


def test_nameless_nats_include_the_times():
    data = Data(FLOOR, [replace(hover(2), lost=np.random.default_rng(0).random(3000) < 0.1)])
    on, (term,) = judging.trial_of(data), all_candidates()["packet_loss"][0]
    packet_loss = judging.cross_validated(on, judging.PricedVariant("packet_loss", (term,), 0.0), None)
    assert packet_loss.gain == pytest.approx(loss(data)[1]) and packet_loss.gain > 100.0
    assert nameless_nats(on, None) - nameless_nats(on, packet_loss) == pytest.approx(packet_loss.gain)


@pytest.mark.parametrize("effects", [
    {"com_offset": {"x": -0.0004, "y": -0.0006}, "actuator_delay": {"delay": 0.0045}},  # a fit that began at nothing
    {"imu_bias": {"acc_x": 0.04, "acc_y": 0.02, "acc_z": -0.02, "gyro_x": 0.001, "gyro_y": -0.005, "gyro_z": 0.003},
     "actuator_delay": {"delay": 0.005}},  # a screening that saw no bias
    {"vibration": {"amplitude": 1.0}, "thrust_coefficient": {"loss": 0.004}},  # a share of what acts elsewhere
])
def test_both_effects_are_named_and_nothing_else(study, effects):
    """Each was missed beside the other once: by the fit, by screening, by what the first must leave."""
    selection = select(Data(study, fly(1, 91, effects)), {n: v for n, v in all_candidates().items() if n in CANDIDATES})
    assert {s.name for s in selection.named_steps} == set(effects)
    assert is_explained(selection)
