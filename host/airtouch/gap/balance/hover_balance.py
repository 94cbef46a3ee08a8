"""Flights without a gyro: what the balance of the motors in hover says, and how unsteady it is.

Angular acceleration is not measured then, but its mean is zero in hover, so the mean
thrusts that the motors were told to give are the torques that act on the vehicle. A rotor
that lost thrust needs a higher command by itself, which shows in lift, roll, pitch and
yaw alike; a weight raises the lift and, off centre, moves commands between opposite
rotors and leaves yaw as it is. Evidence integrates the likelihood over each hypothesis'
prior, so that a hypothesis with more freedom must earn it.

How unsteady a flight is says little of the vehicle unless the position is measured equally
well: the controllers answer every correction of the estimated velocity. Their power is a
part of its own and one in proportion to these corrections, which the log shows.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.optimize import brentq
from scipy.special import ndtri

from airtouch.gap.flights.flight import GROUND, PERIOD_S, Flight
from airtouch.logs.flight_log import VELOCITY
from airtouch.logs.segments import runs
from airtouch.vehicle import Vehicle

#: lift, roll, pitch, yaw in units of a rotor's share of the weight, from thrusts of rotors 1 to 4
MIX = np.array([[1, 1, 1, 1], [-1, -1, 1, 1], [-1, 1, 1, -1], [-1, 1, -1, 1]]) / 4.0
NAMES = ("lift", "roll", "pitch", "yaw", "unsteady", "heave", "corrected_xy", "corrected_z")
VOLTAGE_EXPONENT = 1.2  #: thrust at a PWM grows with voltage to this power (from nominal flights)
SETTLE_S = 0.8  #: left out after take-off and before landing
LEAST_S = 4.0
UNSTEADY_HZ, HEAVE_HZ = (2.0, 35.0), (0.9, 2.0)
#: power of unsteadiness (1/Hz) and heave (m^2/s^4/Hz) for one (m/s)^2 of corrected velocity, sideways and upwards:
#: CrazyPAD's building conditions, 73 flights. E8 and E9 alone: 10^-1.65 and 10^-1.59, 10^2.16 and 10^2.17
#: (`python tools/gap_crazypad.py FLIGHTS --corrections`)
ANSWER = 10.0 ** np.array([-1.62, 2.17])
LEAST_POWER = -9.0  #: log10; nothing logged is below
SAMPLES = 4096  #: of each prior
Manner = tuple[tuple[float, float], tuple[float, float]]


@dataclass(frozen=True)
class Beliefs:
    """What is taken as known beforehand about vehicles and defects.

    between (6,): standard deviations of NAMES between flights of a vehicle as it should be.
    Propellers of one kind differ by 2 % in thrust (0.01 in each of the first four), a battery
    slid by 1 mm moves the centre of mass by 0.2 mm, thrust at a voltage is known to 1 %; the
    last two are of log10 power, without what corrections of the estimate cause.
    own: nominal flights that this is worth beside the scatter of those given.
    worked_on (4,): more of it where the vehicle was worked on: another set of propellers,
    whose torque differs too. So it was before every defect, and before half of the flights
    without one. It is what 16 of CrazyPAD's building conditions differ by beyond their cuts
    (`python tools/gap_crazypad_balance.py`). freedom: of the Student-like tail, as a set may be
    far off.
    loss, weight, hung: half-normal priors of a share of thrust lost, an added share of the
    mass, and of one on a thread, which may rest on the floor.
    reach: farthest place of a weight, over the arm. shift_m: normal prior of a centre of mass
    that moved.
    damaged: mean and deviation of unsteadiness and heave with a damaged rotor (CrazyPAD's
    building conditions: 18 of rotors 0.12 +- 0.25 and -0.20 +- 0.19; four of weights, on tape
    or a thread, -0.03 +- 0.11 and 0.07 +- 0.10, which is nothing).
    """

    between: tuple[float, ...] = (0.012, 0.011, 0.011, 0.014, 0.2, 0.2)
    own: float = 0.5
    worked_on: tuple[float, ...] = (0.013, 0.008, 0.008, 0.024)
    freedom: float = 4.0
    loss: float = 0.12
    weight: float = 0.1
    hung: float = 0.02
    reach: float = 1.2
    shift_m: float = 0.002
    damaged: Manner = ((0.15, 0.25), (-0.2, 0.2))


BELIEFS = Beliefs()
STEADY: Manner = ((0.0, 0.0), (0.0, 0.0))


def pattern(flight: Flight, vehicle: Vehicle, voltage_too: bool = True) -> np.ndarray:
    """NAMES of a flight (8,), lift as its logarithm, the last four log10 of powers; NaN without a hover.

    corrected_xy, corrected_z: variance of what the estimated velocity changes from row to row
    beyond the acceleration, (m/s)^2; LEAST_POWER where the log has no velocity.
    voltage_too: take the lift at 1 V, for flights that log the voltage; else at the voltage flown.
    """
    from scipy.signal import welch  # slow to import, and seldom needed

    weight = vehicle.mass_kg * vehicle.gravity_mps2 / 4.0
    thrust = vehicle.thrust(flight.pwm) / weight
    if voltage_too and flight.log.has("vbat_V"):
        voltage = np.nan_to_num(flight.log["vbat_V"], nan=float(np.nanmedian(flight.log["vbat_V"])))
        thrust = thrust * gaussian_filter1d(voltage, 20, mode="nearest")[:, None] ** VOLTAGE_EXPONENT
    mixed = thrust @ MIX.T
    corrected = _corrections(flight)
    means, power, heave, jumps, size = [], [], [], [], []
    for first, last in hovers(flight):
        part = mixed[first:last]
        means.append(part.mean(axis=0))
        size.append(last - first)
        f, p = welch(part[:, 1:] / part[:, :1].mean(), 1.0 / PERIOD_S, nperseg=256, axis=0)
        power.append(_bands(f, p).mean())
        f, p = welch(flight.acceleration[first:last, 2], 1.0 / PERIOD_S, nperseg=256)
        heave.append(np.log10(p[(f >= HEAVE_HZ[0]) & (f < HEAVE_HZ[1])].mean()))
        jumps.append(corrected[first:last - 1].var(axis=0))
    if not size:
        return np.full(len(NAMES), np.nan)
    mean = np.average(means, axis=0, weights=size)
    x, y, z = np.average(jumps, axis=0, weights=size)
    return np.array([np.log(mean[0]), *(mean[1:] / mean[0]), np.average(power, weights=size),
                     np.average(heave, weights=size), *np.log10(np.maximum([x + y, z], 10.0 ** LEAST_POWER))])


def _corrections(flight: Flight) -> np.ndarray:
    """What the estimated velocity changes from row to row beyond the acceleration, m/s (n - 1, 3); else zeros."""
    if not all(flight.log.has(name) for name in VELOCITY):
        return np.zeros((len(flight) - 1, 3))
    velocity = np.column_stack([flight.log[name] for name in VELOCITY])
    world = np.einsum("nij,nj->ni", flight.turn, flight.acceleration)
    return np.nan_to_num(np.diff(velocity, axis=0) - 0.5 * PERIOD_S * (world[1:] + world[:-1]))


def _bands(f: np.ndarray, p: np.ndarray) -> np.ndarray:
    edges = np.geomspace(*UNSTEADY_HZ, 5)
    pairs = zip(edges[:-1], edges[1:], strict=True)
    return np.array([np.log10(p[(f >= a) & (f < b)].mean(axis=0)) for a, b in pairs])


def hovers(flight: Flight) -> list[tuple[int, int]]:
    """Stretches in the air without take-off and landing."""
    air = (flight.phase != GROUND) & ~flight.on_ground
    trim = int(SETTLE_S / PERIOD_S)
    trimmed = [(a + trim, b - trim) for a, b in runs(air)]
    return [(a, b) for a, b in trimmed if (b - a) * PERIOD_S >= LEAST_S]


@dataclass(frozen=True)
class Reference:
    """Nominal flights: mean (6,) and variance (6,) of a further nominal flight of any session.

    own_power (2,): log10 of the power of unsteadiness and heave that no correction of the estimate causes.
    """

    mean: np.ndarray
    variance: np.ndarray
    own_power: np.ndarray

    def difference(self, seen: np.ndarray) -> np.ndarray:
        """Of a pattern (8,) from the nominal flights' mean: (6,), powers over what their corrections cause."""
        return _over_caused(seen[None], self.own_power)[0] - self.mean


def _caused(table: np.ndarray) -> np.ndarray:
    """Power (flights, 2) of unsteadiness and heave that the corrections of patterns (flights, 8) cause."""
    return ANSWER * 10.0 ** table[:, 6:]


def _over_caused(table: np.ndarray, own_power: np.ndarray) -> np.ndarray:
    """Patterns (flights, 8) without the corrections: (flights, 6), log10 of the powers over those to be expected."""
    return np.column_stack([table[:, :4], table[:, 4:6] - np.log10(10.0 ** own_power + _caused(table))])


def _own_power(power: np.ndarray, caused: np.ndarray) -> float:
    """log10 of the power that flights have beside the one that is caused; power (flights,) log10, caused (flights,)."""
    def mean_over(own: float) -> float:
        return float(np.mean(power - np.log10(10.0 ** own + caused)))
    return LEAST_POWER if mean_over(LEAST_POWER) <= 0.0 else float(brentq(mean_over, LEAST_POWER, power.max()))


def reference(table: np.ndarray, beliefs: Beliefs = BELIEFS) -> Reference:
    """Mean of nominal flights' patterns (flights, 8), and their scatter beside that which is believed."""
    table = table[np.isfinite(table).all(axis=1)]
    own_power = np.array([_own_power(*of) for of in zip(table[:, 4:6].T, _caused(table).T, strict=True)])
    table = _over_caused(table, own_power)
    n, own = len(table), beliefs.own
    squares = ((table - table.mean(axis=0)) ** 2).sum(axis=0)
    variance = (squares + own * np.array(beliefs.between) ** 2) / (n - 1.0 + own)
    return Reference(table.mean(axis=0), variance * (1.0 + 1.0 / n), own_power)


@dataclass(frozen=True)
class Hypothesis:
    """Effects with parameters drawn from the prior (samples,), and their change (samples, 4) of hover."""

    name: str  #: of the family
    prior: float
    effects: tuple[tuple[str, dict], ...]
    change: np.ndarray
    manner: Manner
    worked_on: bool = True  #: since the nominal flights


def hypotheses(vehicle: Vehicle, beliefs: Beliefs = BELIEFS) -> list[Hypothesis]:
    """No effect, one or two weak rotors, a weight at its place, a weight on a thread, something else."""
    from scipy.stats import qmc  # slow to import, and seldom needed

    draw = qmc.Sobol(3, seed=1).random(SAMPLES)
    normal = ndtri(np.clip(draw, 1e-6, 1.0 - 1e-6))
    out = [Hypothesis("none", 0.125, (), np.zeros((1, 4)), STEADY, worked_on) for worked_on in (False, True)]
    loss = np.minimum(beliefs.loss * np.abs(normal), 0.8)
    rise = loss / (1.0 - loss)
    for i in range(4):
        one = (_weak(i, loss[:, 0]),)
        out.append(Hypothesis("weak_motor", 0.15 / 4, one, _rotors({i: rise[:, 0]}), beliefs.damaged))
        for j in range(i):
            two = (_weak(j, loss[:, 0]), _weak(i, loss[:, 1]))
            change = _rotors({j: rise[:, 0], i: rise[:, 1]})
            out.append(Hypothesis("weak_motor", 0.10 / 6, two, change, beliefs.damaged))
    reach, turn = beliefs.reach * vehicle.arm_m * np.sqrt(draw[:, 1]), 2.0 * np.pi * draw[:, 2]
    x, y = reach * np.cos(turn), reach * np.sin(turn)
    half = vehicle.arm_m / np.sqrt(2.0)
    share = beliefs.weight * np.abs(normal[:, 0])
    com = {"x": share / (1.0 + share) * x, "y": share / (1.0 + share) * y}
    out.append(Hypothesis("mass", 0.20, (("mass", {"fraction": share}), ("com_offset", com)),
                          _carried(share, x, y, half), STEADY))
    share = beliefs.hung * np.abs(normal[:, 0])
    tied = {"load": share * vehicle.mass_kg, "x": x, "y": y}
    out.append(Hypothesis("slung_load", 0.25, (("slung_load", tied),), _carried(share, x, y, half),
                          STEADY))
    shift = beliefs.shift_m * normal[:, :2]
    moved = np.column_stack([np.zeros(SAMPLES), shift[:, 1] / half, -shift[:, 0] / half, np.zeros(SAMPLES)])
    out.append(Hypothesis("com_offset", 0.03, (("com_offset", {"x": shift[:, 0], "y": shift[:, 1]}),),
                          moved, STEADY))
    wide = ndtri(np.clip(qmc.Sobol(4, seed=2).random(SAMPLES), 1e-6, 1.0 - 1e-6))
    out.append(Hypothesis("unknown", 0.02, (("unknown", {}),), 0.15 * wide, beliefs.damaged))
    return out


def _carried(share: np.ndarray, x: np.ndarray, y: np.ndarray, half: float) -> np.ndarray:
    """Change of (log lift, roll, pitch, yaw) by a weight of this share of the mass at (x, y)."""
    part = share / (1.0 + share)
    return np.column_stack([np.log1p(share), part * y / half, -part * x / half, np.zeros(len(share))])


def _weak(i: int, loss: np.ndarray) -> tuple[str, dict]:
    return "weak_motor", {"rotor": np.full(SAMPLES, i + 1.0), "thrust_loss": loss}


def _rotors(rise: dict[int, np.ndarray]) -> np.ndarray:
    """Change of (log lift, roll, pitch, yaw) when these rotors are told more by a share."""
    told = np.ones((SAMPLES, 4))
    for i, r in rise.items():
        told[:, i] += r
    mixed = told @ MIX.T
    return np.column_stack([np.log(mixed[:, 0]), mixed[:, 1:] / mixed[:, :1]])


def evidence(seen: np.ndarray, base: Reference, every: Sequence[Hypothesis],
             beliefs: Beliefs = BELIEFS) -> tuple[np.ndarray, list[np.ndarray]]:
    """Log evidence of each hypothesis for a pattern (8,), and the weights of its samples."""
    difference, nu = base.difference(seen), beliefs.freedom
    logs, weights = [], []
    for h in every:
        variance = base.variance[:4] + (np.array(beliefs.worked_on) ** 2 if h.worked_on else 0.0)
        each = np.log1p((difference[:4] - h.change) ** 2 / variance / nu)
        distance = 0.5 * (nu + 1.0) * each.sum(axis=1)
        w = np.exp(distance.min() - distance)
        log = np.log(w.mean()) - distance.min() + np.log(h.prior) - 0.5 * np.log(variance).sum()
        for k, (mean, spread) in enumerate(h.manner):
            width = spread ** 2 + base.variance[4 + k]
            log -= 0.5 * (difference[4 + k] - mean) ** 2 / width + 0.5 * np.log(width)
        logs.append(log)
        weights.append(w / w.sum())
    return np.array(logs), weights


__all__ = ["BELIEFS", "NAMES", "Beliefs", "Hypothesis", "Reference", "evidence", "hypotheses", "pattern",
           "reference"]
