"""The simulator's own loop beside the emulated firmware: the same flight with the same noise in both."""

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np

from airtouch.logs.files import write_bytes
from airtouch.simulation.flight import choose
from airtouch.simulation.scenario import Scenario, draw_flight
from airtouch.simulation.sensors import log_row
from airtouch.simulation.stepper import Stepper
from airtouch.vehicle import Vehicle

from . import flight
from .flight import BOOT_S, REST, EmulatedFlight

ROWS_S = 100  #: rows a second
#: channel -> first column in EmulatedFlight.table, and in the simulator's log
COLUMNS: Mapping[str, tuple[int, int]] = {
    **{f"{axis}, m": (flight.TRUE_X + i, log_row.POSITION + i) for i, axis in enumerate("xyz")},
    **{f"velocity {axis}, m/s": (flight.TRUE_VELOCITY + i, log_row.VELOCITY + i) for i, axis in enumerate("xyz")},
    **{f"{angle}, rad": (flight.TRUE_ANGLES + i, log_row.ANGLES + i)
       for i, angle in enumerate(("roll", "pitch", "yaw"))},
    **{f"acc {axis}, m/s^2": (flight.ACC + i, log_row.ACC + i) for i, axis in enumerate("xyz")},
    **{f"gyro {axis}, rad/s": (flight.GYRO + i, log_row.GYRO + i) for i, axis in enumerate("xyz")},
    **{f"motor {i + 1}, PWM": (flight.MOTOR + i, log_row.PWM + i) for i in range(4)},
    "down range, m": (flight.DOWN, log_row.DOWN),
}


def own_loop(scenario: Scenario, vehicle: Vehicle, seed: int, number: int = 0) -> np.ndarray:
    """(rows, 33) of the simulator's log: the flight that `flight.fly` flies, by the simulator's own firmware.

    It stands on the floor as long before the mission, with the IMU as quiet, so that both draw the same noise. Rows
    begin with the mission and end where it does not go well.
    """
    plan = draw_flight(scenario, seed, number)
    stepper = Stepper(plan, vehicle, seed, number, choose(plan))
    stepper.plant["flow_share"] = 1.0  # as plant.Plant
    stepper.begin(plan.setpoints[0])
    imu = stepper.state[0]["imu"]
    floor = np.empty((int(BOOT_S * ROWS_S), log_row.COLUMNS))
    for name in ("gyro_rms", "acc_rms"):
        imu[name] *= REST
    stepper.fly(np.repeat(plan.setpoints[:1], len(floor), axis=0), floor)
    for name in ("gyro_rms", "acc_rms"):
        imu[name] /= REST
    table = np.empty((len(plan.setpoints), log_row.COLUMNS))
    _, rows = stepper.fly(plan.setpoints, table)
    return table[:rows]


def places(own: np.ndarray) -> np.ndarray:
    """(rows, 4): second of the mission, x, y, z, as the first columns of EmulatedFlight.table."""
    return np.column_stack([own[:, log_row.T] - BOOT_S, own[:, log_row.POSITION:log_row.POSITION + 3]])


Pair = tuple[np.ndarray, np.ndarray]  #: rows of the emulated flight, and the same rows of the simulator's own


def together(one: EmulatedFlight, own: np.ndarray, begin_s: float = 0.0, until_s: float = np.inf) -> Pair:
    """Rows of both from begin_s of the mission to until_s, as long as both fly."""
    table = one.table[one.table[:, flight.T] >= 0.0]
    rows = slice(round(begin_s * ROWS_S), round(min(until_s * ROWS_S, len(table), len(own))))
    return table[rows], own[rows]


def rms(parts: Sequence[np.ndarray]) -> float:
    """Root of the mean square of all values."""
    return float(np.sqrt(np.mean(np.square(np.concatenate(parts)))))


@dataclass(frozen=True)
class Difference:
    """A channel, rms: between the two loops under the same noise; between the own loop's flights under other noise;
    scatter of each loop's flights about their means."""

    channel: str
    loops: float
    draws: float
    emulated: float
    own: float


def differences(pairs: Sequence[Pair], others: Sequence[np.ndarray] = ()) -> list[Difference]:
    """Differences of the loops, for each of COLUMNS.

    others: more flights of the own loop under other noise, from the same second on. draws is NaN for one flight alone.
    """
    out = []
    for name, (a, b) in COLUMNS.items():
        emulated, own = [table[:, a] for table, _ in pairs], [table[:, b] for _, table in pairs]
        flights = own + [table[:, b] for table in others]
        draws = [x[:min(len(x), len(y))] - y[:min(len(x), len(y))] for x, y in combinations(flights, 2)]
        out.append(Difference(name, rms([x - y for x, y in zip(emulated, own, strict=True)]),
                              rms(draws) if draws else np.nan,
                              rms([x - x.mean() for x in emulated]), rms([x - x.mean() for x in own])))
    return out


def write_traces(path: Path, one: EmulatedFlight, own: np.ndarray, force: bool = False) -> None:
    """Both flights as CSV: t_s, and each channel as the emulated firmware and as the simulator's own loop has it."""
    table = one.table[one.table[:, flight.T] >= 0.0]
    n = min(len(table), len(own))
    head = ["t_s", *(f"{name.replace(', ', ' ')} {which}" for name in COLUMNS for which in ("emulated", "own"))]
    columns = [table[:n, flight.T], *(part for a, b in COLUMNS.values() for part in (table[:n, a], own[:n, b]))]
    text = io.StringIO()
    np.savetxt(text, np.column_stack(columns), fmt="%.6g", delimiter=",", header=",".join(head), comments="")
    write_bytes(text.getvalue().encode(), path, force)
