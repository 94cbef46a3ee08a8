"""Flights without a gyro: what the balance of the motors in hover says, and how unsteady it is.

Angular acceleration is not measured then, but its mean is zero in hover, so the mean
thrusts that the motors were told to give are the torques that act on the vehicle. A rotor
that lost thrust needs a higher command by itself, which shows in lift, roll, pitch and
yaw alike; a weight raises the lift and, off centre, moves commands between opposite
rotors and leaves yaw as it is. Six numbers a flight; evidence by integrating the
likelihood over each hypothesis' prior, so that a hypothesis with more freedom must earn it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.signal import welch
from scipy.special import ndtri
from scipy.stats import qmc

from airtouch.gap.flight import GROUND, PERIOD_S, Flight
from airtouch.vehicle import Vehicle

#: lift, roll, pitch, yaw in units of a rotor's share of the weight, from thrusts of rotors 1 to 4
MIX = np.array([[1, 1, 1, 1], [-1, -1, 1, 1], [-1, 1, 1, -1], [-1, 1, -1, 1]]) / 4.0
NAMES = ("lift", "roll", "pitch", "yaw", "unsteady", "heave")
#: standard deviations between flights of a vehicle as it should be: propellers of one kind differ by 2 %
#: in thrust (0.01 in each of the four), a battery slid by 1 mm moves the centre of mass by 0.2 mm, thrust
#: at a voltage is known to 1 %. The last two are of log10 power.
BETWEEN = np.array([0.012, 0.011, 0.011, 0.014, 0.2, 0.2])
#: on top of that for a vehicle that was worked on: another set of propellers, whose torque differs too
WORKED_ON = np.array([0.012, 0.012, 0.012, 0.02])
OWN = 0.5  #: nominal flights that BETWEEN is worth beside the scatter of the flights given
VOLTAGE_EXPONENT = 1.2  #: thrust at a PWM grows with voltage to this power (from nominal flights)
SETTLE_S = 0.8  #: left out after take-off and before landing
LEAST_S = 4.0
UNSTEADY_HZ, HEAVE_HZ = (2.0, 35.0), (0.9, 2.0)
SAMPLES = 4096  #: of each prior
LOSS = 0.12  #: half-normal prior of a share of thrust lost
WEIGHT = 0.1  #: half-normal prior of an added share of the mass
FREEDOM = 4.0  #: of the Student-like tail: now and then a set of propellers is far off
REACH = 1.2  #: farthest place of a weight, over the arm
SHIFT_M = 0.002  #: normal prior of a centre of mass that moved
HUNG = 0.02  #: of a weight on a thread, which may rest on the floor
#: mean and deviation of unsteadiness and heave: without effect; a damaged rotor; a weight; a weight on a thread
STEADY, DAMAGED = ((0.0, 0.0), (0.0, 0.0)), ((0.4, 0.35), (0.1, 0.5))
LOADED, SWINGING = ((0.4, 0.35), (0.6, 0.4)), ((0.4, 0.35), (0.6, 0.4))


def pattern(flight: Flight, vehicle: Vehicle) -> np.ndarray:
    """(6,): NAMES of a flight; the lift at 1 V where a voltage is logged, and at the voltage flown elsewhere."""
    weight = vehicle.mass_kg * vehicle.gravity_mps2 / 4.0
    thrust = vehicle.thrust(flight.pwm) / weight
    if flight.log.has("vbat_V"):
        voltage = np.nan_to_num(flight.log["vbat_V"], nan=float(np.nanmedian(flight.log["vbat_V"])))
        thrust = thrust * gaussian_filter1d(voltage, 20, mode="nearest")[:, None] ** VOLTAGE_EXPONENT
    mixed = thrust @ MIX.T
    means, power, heave, size = [], [], [], []
    for first, last in _hovers(flight):
        part = mixed[first:last]
        means.append(part.mean(axis=0))
        size.append(last - first)
        f, p = welch(part[:, 1:] / part[:, :1].mean(), 1.0 / PERIOD_S, nperseg=256, axis=0)
        power.append(_bands(f, p).mean())
        f, p = welch(flight.acceleration[first:last, 2], 1.0 / PERIOD_S, nperseg=256)
        heave.append(np.log10(p[(f >= HEAVE_HZ[0]) & (f < HEAVE_HZ[1])].mean()))
    if not size:
        return np.full(len(NAMES), np.nan)
    mean = np.average(means, axis=0, weights=size)
    return np.array([np.log(mean[0]), *(mean[1:] / mean[0]), np.average(power, weights=size),
                     np.average(heave, weights=size)])


def _bands(f: np.ndarray, p: np.ndarray) -> np.ndarray:
    edges = np.geomspace(*UNSTEADY_HZ, 5)
    return np.array([np.log10(p[(f >= a) & (f < b)].mean(axis=0)) for a, b in zip(edges[:-1], edges[1:], strict=True)])


def _hovers(flight: Flight) -> list[tuple[int, int]]:
    """Stretches in the air without take-off and landing."""
    air = (flight.phase != GROUND) & ~flight.on_ground
    change = np.flatnonzero(np.diff(np.concatenate([[0], air.astype(np.int8), [0]])))
    trim = int(SETTLE_S / PERIOD_S)
    found = [(a + trim, b - trim) for a, b in zip(change[::2], change[1::2], strict=True)]
    return [(a, b) for a, b in found if (b - a) * PERIOD_S >= LEAST_S]


@dataclass(frozen=True)
class Reference:
    """Nominal flights: mean (6,) and variance (6,) of a further nominal flight of any session."""

    mean: np.ndarray
    variance: np.ndarray


def reference(flights: Sequence[Flight], vehicle: Vehicle) -> Reference:
    """Mean of the nominal flights; their own scatter adds to that between sessions."""
    table = np.array([pattern(f, vehicle) for f in flights])
    table = table[np.isfinite(table).all(axis=1)]
    n = len(table)
    squares = ((table - table.mean(axis=0)) ** 2).sum(axis=0)
    return Reference(table.mean(axis=0), (squares + OWN * BETWEEN ** 2) / (n - 1.0 + OWN) * (1.0 + 1.0 / n))


@dataclass(frozen=True)
class Hypothesis:
    """Effects with their parameters drawn from the prior (samples,), and the change (samples, 4) of hover."""

    name: str  #: of the family
    prior: float
    effects: tuple[tuple[str, dict], ...]
    change: np.ndarray
    manner: tuple[tuple[float, float], tuple[float, float]]


def hypotheses(vehicle: Vehicle) -> list[Hypothesis]:
    """No effect, one or two weak rotors, a weight at its place, a weight on a thread, something else."""
    draw = qmc.Sobol(3, seed=1).random(SAMPLES)
    normal = ndtri(np.clip(draw, 1e-6, 1.0 - 1e-6))
    out = [Hypothesis("none", 0.25, (), np.zeros((1, 4)), STEADY)]
    loss = np.minimum(LOSS * np.abs(normal), 0.8)
    rise = loss / (1.0 - loss)
    for i in range(4):
        out.append(Hypothesis("weak_motor", 0.15 / 4, (_weak(i, loss[:, 0]),), _rotors({i: rise[:, 0]}), DAMAGED))
        for j in range(i):
            effects = (_weak(j, loss[:, 0]), _weak(i, loss[:, 1]))
            out.append(Hypothesis("weak_motor", 0.10 / 6, effects, _rotors({j: rise[:, 0], i: rise[:, 1]}), DAMAGED))
    reach, turn = REACH * vehicle.arm_m * np.sqrt(draw[:, 1]), 2.0 * np.pi * draw[:, 2]
    x, y = reach * np.cos(turn), reach * np.sin(turn)
    half = vehicle.arm_m / np.sqrt(2.0)
    for name, prior, spread, manner in (("mass", 0.20, WEIGHT, LOADED), ("slung_load", 0.25, HUNG, SWINGING)):
        share = spread * np.abs(normal[:, 0])
        part = share / (1.0 + share)
        change = np.column_stack([np.log1p(share), part * y / half, -part * x / half, 0.0 * share])
        effects = (("mass", {"fraction": share}), ("com_offset", {"x": part * x, "y": part * y})) if name == "mass" \
            else ((name, {"load": share * vehicle.mass_kg, "x": x, "y": y}),)
        out.append(Hypothesis(name, prior, effects, change, manner))
    shift = SHIFT_M * normal[:, :2]
    out.append(Hypothesis("com_offset", 0.03, (("com_offset", {"x": shift[:, 0], "y": shift[:, 1]}),), np.column_stack(
        [0.0 * shift[:, 0], shift[:, 1] / half, -shift[:, 0] / half, 0.0 * shift[:, 0]]), LOADED))
    wide = ndtri(np.clip(qmc.Sobol(4, seed=2).random(SAMPLES), 1e-6, 1.0 - 1e-6))
    out.append(Hypothesis("unknown", 0.02, (("unknown", {}),), 0.15 * wide, DAMAGED))
    return out


def _weak(i: int, loss: np.ndarray) -> tuple[str, dict]:
    return "weak_motor", {"rotor": np.full(SAMPLES, i + 1.0), "thrust_loss": loss}


def _rotors(rise: dict[int, np.ndarray]) -> np.ndarray:
    """Change of (log lift, roll, pitch, yaw) when these rotors are told more by a share."""
    told = np.ones((SAMPLES, 4))
    for i, r in rise.items():
        told[:, i] += r
    mixed = told @ MIX.T
    return np.column_stack([np.log(mixed[:, 0]), mixed[:, 1:] / mixed[:, :1]])


def evidence(seen: np.ndarray, base: Reference, every: Sequence[Hypothesis]) -> tuple[np.ndarray, list[np.ndarray]]:
    """Log evidence of each hypothesis for a pattern (6,), and the weights of its samples."""
    apart = seen - base.mean
    logs, weights = [], []
    for h in every:
        variance = base.variance[:4] + (WORKED_ON ** 2 if h.effects else 0.0)
        tail = FREEDOM * np.log1p((apart[:4] - h.change) ** 2 / variance / FREEDOM)
        distance = 0.5 * (FREEDOM + 1.0) / FREEDOM * tail.sum(axis=1)
        w = np.exp(distance.min() - distance)
        log = np.log(w.mean()) - distance.min() + np.log(h.prior) - 0.5 * np.log(variance).sum()
        for k, (mean, spread) in enumerate(h.manner):
            width = spread ** 2 + base.variance[4 + k]
            log -= 0.5 * (apart[4 + k] - mean) ** 2 / width + 0.5 * np.log(width)
        logs.append(log)
        weights.append(w / w.sum())
    return np.array(logs), weights


__all__ = ["NAMES", "Hypothesis", "Reference", "evidence", "hypotheses", "pattern", "reference"]
