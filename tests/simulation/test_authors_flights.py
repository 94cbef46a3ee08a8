"""The nominal simulator beside the authors' flights: hover level, slope, spectra; lift over the platform.

Noise, battery, gains and ground effect were set on folds 0 to 2 of the manifest; the flights
here are folds 3 and 4.
"""

import csv

import numpy as np
import pytest
from scipy.signal import lfilter, welch

from airtouch import logs
from airtouch import vehicle as vehicles
from airtouch.logs import airborne, true_edges
from airtouch.logs.flight_log import ACC_WORLD, GYRO, PWM
from airtouch.simulation import batch, flight

BANDS = ((0.3, 1), (1, 2), (2, 4), (4, 6), (6, 8), (8, 12), (12, 20), (20, 30), (30, 40), (40, 50))


def hover(log):
    """Band powers (6, bands) of acceleration and gyro, mean PWM, its slope; None where too short."""
    start, stop = np.argmax(airborne(log)) + 500, true_edges(log)[0].sample - 150
    if stop - start < 500:
        return None
    part = log.slice(start, stop)
    f, power = welch(part.stack((*ACC_WORLD, *GYRO)), fs=100.0, nperseg=400, detrend="linear", axis=0)
    pwm = part.stack(PWM).mean(1)
    bands = np.array([power[(f >= low) & (f < high)].mean(0) for low, high in BANDS])
    return bands.T, pwm.mean(), np.polyfit(np.arange(len(pwm)) * 0.01, pwm, 1)[0]


def lift(log):
    """(down range in m, vertical disturbance in weights) over the platform, less that before and after."""
    entry, leave = (e.sample for e in true_edges(log)[:2])
    vehicle = vehicles.load()
    lag = 1 - np.exp(-0.01 / 0.06)
    thrust = np.roll(lfilter([lag], [1, lag - 1], vehicle.thrust(log.stack(PWM)).sum(1)), 1)
    force = vehicle.mass_kg * log["acc_world_z_mps2"] - thrust
    base = np.r_[force[entry - 150:entry - 20], force[leave + 60:leave + 150]].mean()
    gain = (force[entry + 30:leave - 10].mean() - base) / (vehicle.mass_kg * vehicle.gravity_mps2)
    return np.median(log["zrange_m"][entry + 20:leave - 10]), gain


@pytest.fixture(scope="module")
def real(flights):
    folder = flights / "airtouch"
    with open(folder / "manifest.csv") as file:
        return [logs.read(folder / row["file"]) for row in csv.DictReader(file)
                if row["use"] == "clean" and row["fold"] in "34"]


@pytest.fixture(scope="module")
def simulated():
    results = batch.flights("paper-mixed", 40, workers=2)
    flights = [r for r in results if not isinstance(r, flight.Diverged)]
    assert len(flights) >= 38
    return flights


def test_hover_command_level_and_slope(real, simulated):
    levels, slopes = ([np.array([h[k] for h in map(hover, group) if h]) for group in (real,
            simulated)] for k in (1, 2))
    assert abs(levels[0].mean() - levels[1].mean()) < levels[0].std()
    assert abs(slopes[0].mean() - slopes[1].mean()) < slopes[0].std()


def test_hover_spectra(real, simulated):
    """Median over flights, 6 channels by 10 bands: 85 % within 3 dB, all within 5 dB."""
    medians = [np.median([h[0] for h in map(hover, group) if h], axis=0) for group in (real, simulated)]
    difference_db = np.abs(10 * np.log10(medians[1] / medians[0]))
    print(np.round(10 * np.log10(medians[1] / medians[0]), 1))
    assert np.mean(difference_db < 3.0) >= 0.85
    assert difference_db.max() < 5.0


@pytest.mark.parametrize(("low", "high"), [(0.02, 0.045), (0.045, 0.065), (0.065, 0.12)])
def test_lift_over_the_platform_by_height(real, simulated, low, high):
    """Mean lift in each class of down range, share of the weight, at the real flights' heights:
    within 1.1 % of the weight."""
    lifts = [np.array([lift(log) for log in group if len(true_edges(log)) >= 2]) for group in (real, simulated)]
    real_class, near = ((x[(x[:, 0] >= a) & (x[:, 0] < b)]) for x, a, b in (
        (lifts[0], low, high), (lifts[1], low - 0.01, high + 0.01)))
    slope, level = np.polyfit(near[:, 0], near[:, 1], 1)
    assert level + slope * real_class[:, 0].mean() == pytest.approx(real_class[:, 1].mean(), abs=0.011)
