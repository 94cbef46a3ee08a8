"""Lines of turning rotors: where they lie, how wide and how strong they are, and the speeds that say so."""

import numpy as np
import pytest
from scipy.optimize import minimize_scalar
from scipy.stats import lomax

from airtouch import vehicle as vehicles
from airtouch.gap.evidence import vibration_lines
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.likelihood import REPLAY_FREEDOM
from airtouch.gap.nominal.build_study import declared_study
from airtouch.gap.signals.spectra import AIR, frequencies
from gap_flights import flight as made_flight
from imu_flights import FASTER, fly

VEHICLE = vehicles.load()
ASSUMED = 2.1e-8  #: thrust over speed squared of a vehicle that declares none, N s^2/rad^2


def test_lines_of_steady_rotors_lie_at_their_fold_with_their_power():
    turns = np.array([318.0, 327.0, 336.0, 345.0])
    speed = np.tile(2.0 * np.pi * turns, (400, 1))
    hover = 2.0 * np.pi * 327.0
    power = vibration_lines.folded(vibration_lines.two_sided(speed, hover, np.array([0, 128])))
    f = frequencies(AIR)
    for k, place in enumerate((18.0, 27.0, 36.0, 45.0)):
        line = power[0, np.abs(f - place) < 2.0].sum() * f[1]
        assert line == pytest.approx(0.5 * 0.5 ** 2 * (turns[k] / 327.0) ** 4, rel=0.02)
        assert abs(f[np.argmax(np.where(np.abs(f - place) < 4.0, power[0], 0.0))] - place) <= f[1]
    assert np.all(vibration_lines.folded(np.ones((1, 256)))[0, 1:-1] == 0.5)


def test_a_rotor_whose_speed_was_lost_turns_on():
    rpm = np.linspace(19000.0, 21000.0, 400)
    lost = (np.arange(400) % 40) < 3
    one = made_flight(4.0)
    one.log.columns.update({name: np.where(lost, np.nan, rpm) for name in vibration_lines.RPM})
    speed = vibration_lines.speeds(one, declared_study(VEHICLE, ()))
    assert speed == pytest.approx(np.tile(rpm[:, None] * np.pi / 30.0, 4), rel=1e-2)


def test_a_spread_keeps_the_power_and_has_its_width():
    speed = np.full((256, 4), 2.0 * np.pi * 325.0)
    sharp = vibration_lines.two_sided(speed, speed[0, 0], np.array([0]))
    wide = vibration_lines.widened(sharp, 3.0)
    assert wide.sum() == pytest.approx(sharp.sum(), rel=1e-6)
    f = np.fft.fftfreq(256, 0.01)
    middle = (f * wide[0]).sum() / wide.sum()
    near = np.abs(f - 25.0) < 12.0
    spread = np.sqrt(((f - middle) ** 2 * wide[0])[near].sum() / wide[0, near].sum())
    assert middle == pytest.approx(25.0, abs=0.3) and spread == pytest.approx(3.0, rel=0.1)


def test_lines_of_rotors_that_turn_at_another_speed_are_found_where_they_are(study):
    """Thrust over speed squared is not declared, so that the fold lies anywhere. Hover is where thrust is weight."""
    flights = fly(1, {"vibration": {"amplitude": 1.0, "gyro": 0.05}}, seed=46, vehicle=FASTER)
    own, assumed = (np.sqrt(VEHICLE.mass_kg * VEHICLE.gravity_mps2 / 4.0 / k) / (2.0 * np.pi)
                    for k in (FASTER.thrust_per_speed2, ASSUMED))
    assert vibration_lines.lines(Data(study, flights)).shift * frequencies(AIR)[1] \
        == pytest.approx(own - assumed, abs=1.2)


@pytest.mark.parametrize("strength", [0.1, 3.0])
def test_the_strength_of_lines_is_the_likeliest(strength):
    """Against SciPy's optimum, of powers drawn with lines in one bin of four by the law of the tails: Lomax's."""
    rng, freedom = np.random.default_rng(6), REPLAY_FREEDOM
    shape = np.where(np.arange(64) % 4 == 0, rng.uniform(0.5, 2.0, 64), 0.0) * np.ones((20, 1))
    over = (1.0 + strength * shape) * freedom * rng.pareto(freedom, shape.shape)

    def gain(x):
        with_lines, without = (lomax.logpdf(over, freedom, scale=freedom * p) for p in (1.0 + x * shape, 1.0))
        return (with_lines - without).sum()

    best = minimize_scalar(lambda log_x: -gain(np.exp(log_x)), bounds=(-6.0, 3.0), method="bounded")
    gained, likeliest = vibration_lines.best_strength(over, shape)
    finest = vibration_lines.FINER_FACTORS[1] / vibration_lines.FINER_FACTORS[0]
    assert abs(np.log(likeliest) - best.x) < np.log(finest), "the next of the strengths that are tried"
    assert gained == pytest.approx(gain(likeliest), rel=1e-9)
