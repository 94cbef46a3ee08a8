"""The inertia of a rotor from a flight whose yaw follows the equation of motion, and from a real flight."""

import sys

import numpy as np
import pytest

from airtouch import logs, vehicle
from airtouch.errors import AirTouchError
from airtouch.logs.flight_log import FlightLog
from skips import folder
from tools.calibration import rotor_inertia

CRAFT = vehicle.load("crazyflie-2.1")
RATIO, DELAY_S, STEP_S = 2e-3, 0.008, 0.002


def log_of(inertia_ratio, noise_rpm=0.0, seconds=60.0):
    """500 Hz; rotors follow a random yaw command in 50 ms; yaw acceleration = 0.05 D + ratio dD/dt, 8 ms late."""
    rng = np.random.default_rng(0)
    n = round(seconds / STEP_S)
    command = np.convolve(rng.normal(0.0, 2000.0, n), np.ones(20) / 20 ** 0.5, "same")
    command[:round(1.0 / STEP_S)] = 0.0
    lag = np.zeros(n)  # D, rad/s
    for i in range(1, n):
        lag[i] = lag[i - 1] + STEP_S / 0.05 * (0.1 * command[i] - lag[i - 1])
    rate = np.cumsum(0.05 * lag) * STEP_S + inertia_ratio * lag
    late = round(DELAY_S / STEP_S)
    signs = -np.array(rotor_inertia.SPIN)
    columns = {"t_s": np.arange(n) * STEP_S, "gyro_z_radps": np.concatenate([np.zeros(late), rate[:-late]])}
    for i, sign in enumerate(signs):
        columns[f"m{i + 1}_pwm"] = 40000.0 + sign * command / 4.0
        columns[f"rpm_{i + 1}"] = 20000.0 + sign * lag / 4.0 * 60.0 / (2.0 * np.pi) + rng.normal(0.0, noise_rpm, n)
    return FlightLog(columns, {"source": "synthetic"})


@pytest.mark.parametrize("noise_rpm", [0.0, 100.0])
@pytest.mark.parametrize("ratio", [0.0, RATIO])
def test_it_finds_what_the_equation_of_motion_holds(ratio, noise_rpm):
    """Noise of the measured speeds does not pull it down, as it would in a regression on them."""
    f, blocks, speed = rotor_inertia.spectra(log_of(ratio, noise_rpm), CRAFT.arm_pwm)
    (gain, inertia_ratio, delay), share = rotor_inertia.fit(f, blocks)
    assert inertia_ratio == pytest.approx(ratio, abs=1e-4) and gain == pytest.approx(0.05, rel=0.05)
    assert delay == pytest.approx(DELAY_S, abs=2e-3) and share > 0.95
    assert speed == pytest.approx(20000.0 * 2.0 * np.pi / 60.0, rel=0.01)


def test_a_flight_that_is_too_short_is_refused():
    with pytest.raises(AirTouchError, match="longer"):
        rotor_inertia.spectra(log_of(RATIO, seconds=8.0), CRAFT.arm_pwm)


def test_a_refused_flight_has_a_line_on_stderr_and_the_others_are_done(tmp_path, monkeypatch, capsys):
    for name, seconds in (("short", 8.0), ("long", 20.0)):
        logs.write(log_of(RATIO, seconds=seconds), tmp_path / f"{name}.csv")
    monkeypatch.setattr(sys, "argv", ["rotor_inertia.py", f"{tmp_path}/short.csv", f"{tmp_path}/long.csv"])
    assert rotor_inertia.main() == 2
    printed = capsys.readouterr()
    assert printed.out.startswith("long.csv: ") and len(printed.out.splitlines()) == 1
    assert printed.err.startswith("rotor_inertia: ") and "longer flight" in printed.err
    assert len(printed.err.splitlines()) == 1


def test_a_real_crazyflies_rotors_have_inertia():
    """A rotor's 47 mm propeller of 0.3 g as a bar has 5.5e-8 kg m²; the fit knows neither."""
    path = folder() / "imrclab" / "brushed_jana04.csv.gz"
    if not path.is_file():
        pytest.skip("no recorded flights")
    f, blocks, _ = rotor_inertia.spectra(logs.read(path), CRAFT.arm_pwm)
    (_, ratio, _), share = rotor_inertia.fit(f, blocks)
    assert 2e-8 < ratio * CRAFT.inertia_kg_m2[2] < 8e-8
    assert share - rotor_inertia.fit(f, blocks, with_inertia=False)[1] > 0.2
