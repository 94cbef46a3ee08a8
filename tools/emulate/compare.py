"""The same flight twice: in emulation with the app and without, and in the simulator's own loop."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from airtouch import vehicle as vehicles
from airtouch.logs.flight_log import PWM, FlightLog
from airtouch.simulation import scenario
from airtouch.simulation.flight import fly as simulated
from airtouch.simulation.flight_plan.world import top_at
from airtouch.simulation.scenario import Scenario, draw_flight
from airtouch.vehicle import Vehicle
from tools.emulate.flight import BOOT_S, Flown, fly
from tools.emulate.plant import STEP_S
from tools.emulate.replay import VEHICLE

SCENARIO = Path(__file__).with_name("there-and-back.toml")


def vehicle() -> Vehicle:
    """The drone with the firmware as shipped: no range module."""
    return replace(vehicles.load(VEHICLE), range_module="firmware")


def crossings(flown: Scenario, seed: int, flight: int, table: np.ndarray) -> list[tuple[float, str]]:
    """(s, kind) at which the drone crossed the platform's edges in truth."""
    ground = draw_flight(flown, seed, flight).world
    over = np.array([top_at(ground, x, y) > 0.01 for x, y in table[:, 1:3]])
    at = np.flatnonzero(np.diff(over.astype(int)))
    return [(float(table[i + 1, 0]), "entry" if over[i + 1] else "exit") for i in at]


def apart(one: Flown, log: FlightLog, until_s: float) -> dict[str, float]:
    """How far the emulated flight is from the simulator's own, at the same seconds in the air up to until_s: rms."""
    table = one.table[(one.table[:, 0] >= 0.0) & (one.table[:, 0] < until_s)]
    n = min(len(table), len(log))
    flies = (table[:n, 3] > 0.3) & (log["z_m"][:n] > 0.3)

    def rms(emulated: np.ndarray, own: np.ndarray) -> float:
        return float(np.sqrt(np.mean(np.square(emulated[:n][flies] - own[:n][flies]))))

    return {"seconds": float(flies.sum() / 100.0), "height m": rms(table[:, 3], log["z_m"]),
            "x m": rms(table[:, 1], log["x_m"]),
            "y m": rms(table[:, 2], log["y_m"]),
            "mean motor PWM": rms(table[:, 4:8].mean(axis=1), log.stack(PWM).mean(axis=1))}


def differing(one: Flown, other: Flown) -> tuple[int, int, int, int]:
    """Motor commands that differ, of how many, the first, and the most by which that one does."""
    n = min(len(one.pwm), len(other.pwm))
    gap = np.abs(one.pwm[:n].astype(int) - other.pwm[:n]).max(axis=1)
    at = np.flatnonzero(gap)
    return len(at), n, int(at[0]) if len(at) else -1, int(gap[at[0]]) if len(at) else 0


def report(elf: Path, seed: int = 1) -> bool:
    """Fly, print; whether the app changed no motor command where the clock goes in whole milliseconds."""
    flown = scenario.load(SCENARIO)
    on, off = fly(elf, flown, vehicle(), seed), fly(elf, flown, vehicle(), seed, app=False)
    other, n, first, by = differing(on, off)
    print(f"there-and-back, seed {seed}: with the app {on.ending}, without {off.ending}")
    print(f"motors: {other} of {n} commands differ"
          + (f", the first at {first * STEP_S - BOOT_S:.2f} s by {by} of 65535" if other else ""))
    coarse = [fly(elf, flown, vehicle(), seed, app=app, whole_milliseconds=True) for app in (True, False)]
    same, n, _, _ = differing(*coarse)
    print(f"with a clock of whole milliseconds: {same} of {n} commands differ")
    print(f"stabilizer, sensor to motors: worst {on.latency_us} us with the app, {off.latency_us} us without, median "
          f"{np.median(on.latencies_us):.0f} us; app: late {on.late}, longest step {on.load_us} us")
    for what, one in (("with the app", on), ("the same, whole milliseconds", coarse[0])):
        true = crossings(flown, seed, 0, one.table)
        print(f"{what}: edges crossed " + (" ".join(f"{kind}@{t:.2f}" for t, kind in true) or "none") + ", felt "
              + (" ".join(f"{kind}@{t:.2f}" for t, kind, _ in one.edges) or "none") + " (s)")
    log = simulated(flown, vehicle(), seed)
    if isinstance(log, FlightLog):
        edge = crossings(flown, seed, 0, on.table)
        for what, until in (("before the first edge", edge[0][0] if edge else np.inf), ("all", np.inf)):
            print(f"beside the simulator's own loop, {what}, rms: "
                  + ", ".join(f"{k} {v:.3g}" for k, v in apart(on, log, until).items()))
    else:
        print(f"the simulator's own loop: {log}")
    return same == 0 and len(coarse[0].pwm) == len(coarse[1].pwm)
