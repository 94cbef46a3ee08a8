"""Prints the moment of inertia of a rotor, from how much a change of the rotors' speeds turns the vehicle in yaw.

    python tools/calibration/rotor_inertia.py ../shared/flights/imrclab/brushed_jana04.csv.gz    # 4 s a flight

A rotor that speeds up pushes the body the other way round. With D = w2 + w4 - w1 - w3, rotor speeds (rad/s) of the
rotors that turn one way less those of the others, the yaw acceleration is (2 w k yaw D + I dD/dt) / Jz: w mean speed,
k thrust over speed squared, yaw torque over thrust, I a rotor's inertia, Jz the body's. The transfer function from D
to the measured yaw acceleration is the ratio of their cross-spectra with the commanded yaw, so that noise of the
speeds does not count; a delay of the gyro is fitted too. Printed for each flight: I / Jz, I for the vehicle's Jz,
yaw torque over thrust, delay, each with its 90 % interval (bootstrap over blocks of 4 s), and what fraction of the yaw
acceleration from 1 to 12 Hz that follows the command is explained with I and without. A flight that cannot be used
has a line on stderr; the exit code is then 2.
host/docs/twin-method.md has the figures.
"""

import argparse
import sys
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from airtouch import logs, vehicle
from airtouch.detector.evaluation.bootstrap import resampled
from airtouch.errors import AirTouchError, in_one_line
from airtouch.logs.checks.clock import sample_period
from airtouch.logs.flight_log import PWM, FlightLog
from airtouch.simulation.body.rigid_body import SPIN
from airtouch.vehicle import Vehicle

RPM = tuple(f"rpm_{i}" for i in range(1, 5))  #: columns of the rotor speeds, 1/min
BAND_HZ = (1.0, 12.0)  #: below it the yaw controller hardly commands, above it the gyro's low-pass begins
BLOCK_S = 4.0  #: s of a block of a spectrum; no source: round number
MIN_BLOCKS = 4  #: that a flight must hold; no source: least for a bootstrap
EDGE_S = 1.0  #: s left out after take-off and before landing; no source: round number
DRAWS = 200  #: bootstrap samples over blocks; no source: round number


def spectra(log: FlightLog, arm_pwm: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Frequencies (k,) Hz; cross-spectra (blocks, 2, k) of D and yaw acceleration with the yaw command; mean w, rad/s.

    Raises AirTouchError without rotor speeds, gyro and motors, and for less than four blocks in the air.
    """
    log.require(*RPM, *PWM, "gyro_z_radps")
    period, signs = sample_period(log), -np.array(SPIN)
    speed, pwm = log.stack(RPM) * 2.0 * np.pi / 60.0, log.stack(PWM)
    flying = np.flatnonzero(pwm.mean(axis=1) > arm_pwm)
    length, edge = round(BLOCK_S / period), round(EDGE_S / period)
    inside = slice(flying[0] + edge, flying[-1] - edge) if len(flying) else slice(0, 0)
    signals = np.column_stack([pwm @ signs, speed @ signs, log["gyro_z_radps"]])[inside]
    starts = range(0, len(signals) - length + 1, length // 2)
    if len(starts) < MIN_BLOCKS:
        raise AirTouchError(f"{log.source}: less than {2.5 * BLOCK_S:g} s in the air; give a longer flight")
    f = np.fft.rfftfreq(length, period)
    inner = (f >= BAND_HZ[0]) & (f <= BAND_HZ[1])
    window, out = np.hanning(length)[:, None], []
    for start in starts:
        block = signals[start:start + length]
        command, difference, rate = np.fft.rfft((block - block.mean(axis=0)) * window, axis=0)[inner].T
        out.append([np.conj(command) * difference, np.conj(command) * rate * 2j * np.pi * f[inner]])
    return f[inner], np.array(out), float(speed[inside].mean())


def fit(f: np.ndarray, blocks: np.ndarray, with_inertia: bool = True) -> tuple[np.ndarray, float]:
    """((steady gain, I / Jz, delay s), fraction of the yaw acceleration's cross-spectrum explained) of `spectra`."""
    difference, yaw = blocks.mean(axis=0)
    scale = np.sqrt(np.mean(np.abs(blocks[:, 1]) ** 2, axis=0))  # each frequency counts alike

    def residual(x: np.ndarray) -> np.ndarray:
        """Residuals (2 k,), real and imaginary, over `scale`, with steady gain, I / Jz and delay x."""
        modelled = (x[0] + 2j * np.pi * f * x[1] * with_inertia) * np.exp(-2j * np.pi * f * x[2]) * difference
        error = (yaw - modelled) / scale
        return np.concatenate([error.real, error.imag])

    solution = least_squares(residual, [1e-2, 1e-3, 0.005], x_scale=[1e-2, 1e-3, 5e-3])
    return solution.x, 1.0 - float((residual(solution.x) ** 2).sum() / (np.abs(yaw / scale) ** 2).sum())


def report(log: FlightLog, craft: Vehicle) -> str:
    """The line of one flight."""
    f, blocks, speed = spectra(log, craft.arm_pwm)
    (gain, ratio, delay), explained = fit(f, blocks)
    low, high = resampled(lambda pick: fit(f, blocks[pick])[0], len(blocks), replicates=DRAWS, level=0.9)
    jz = craft.inertia_kg_m2[2]
    lever = jz * speed / (2.0 * craft.mass_kg * craft.gravity_mps2 / 4.0)  # of torque over thrust to the steady gain
    return (f"{Path(log.source).name}: I/Jz {ratio:.2e} ({low[1]:.2e} to {high[1]:.2e}), I {ratio * jz:.1e} kg m² for "
            f"Jz {jz:.3g}, torque over thrust {gain * lever:.4f} m ({low[0] * lever:.4f} to {high[0] * lever:.4f}), "
            f"delay {1000 * delay:.0f} ms, {len(blocks)} blocks; explained {explained:.0%}, without inertia "
            f"{fit(f, blocks, False)[1]:.0%}")


def main() -> int:
    """Print a line for each flight; 2 where one was refused."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("flights", type=Path, nargs="+", help="logs with rotor speeds")
    parser.add_argument("--vehicle", default="crazyflie-2.1", help="name or file: mass and Jz (default %(default)s)")
    options = parser.parse_args()
    craft = vehicle.load(options.vehicle)
    refused = 0
    for path in options.flights:
        try:
            print(report(logs.read(path), craft), flush=True)
        except AirTouchError as error:
            refused = 2
            print(f"rotor_inertia: {error}", file=sys.stderr, flush=True)
    return refused


if __name__ == "__main__":
    with in_one_line("rotor_inertia"):
        sys.exit(main())
