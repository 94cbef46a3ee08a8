"""Height over a platform, flown: the same missions by the firmware as it ships and with atHeight.enable."""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import product
from pathlib import Path

import numpy as np

from airtouch.detector.evaluation.score import TOLERANCE_S, match
from airtouch.errors import AirTouchError
from airtouch.logs.files import make_folder, write_bytes

from .compare import crossings, cruise, height_range, vehicle, words
from .flight import TRUE_X, X, fly
from .missions import CRUISE_M, Case, cases, mission

#: names of a flight without and with the height over a platform
SETTINGS = ("as it ships", "atHeight.enable 1")
MOST_DELAY_S = 2.5  #: a report further than this from every crossing of its kind is false


def delays(crossed: Sequence[tuple[float, str]], reported: Sequence[tuple[float, str]]) -> np.ndarray:
    """Seconds by which reports follow their crossings (s, kind): of the same kind, one to one, within MOST_DELAY_S."""
    late = []
    for kind in ("entry", "exit"):
        true, detected = ([t for t, k in edges if k == kind] for edges in (crossed, reported))
        late += [detected[j] - true[i] for i, j in match(true, detected, MOST_DELAY_S)]
    return np.array(late)


@dataclass(frozen=True)
class Leg:
    """A flight of a case: how it ended, and what it shows.

    low_m, high_m: of the height over the floor. crossed, reported: edges (s, kind) in truth and by the app. end_m,
    own_end_m: x before the landing, in truth and by its own estimate; it began at 0.
    """

    ending: str
    low_m: float
    high_m: float
    crossed: list[tuple[float, str]]
    reported: list[tuple[float, str]]
    end_m: float
    own_end_m: float
    latency_us: int


def summary(legs: Sequence[Leg]) -> str:
    """All flights of a case with one setting."""
    late = [delays(leg.crossed, leg.reported) for leg in legs]
    late_s, crossed = np.concatenate(late), sum(len(leg.crossed) for leg in legs)
    false = sum(len(leg.reported) for leg in legs) - len(late_s)
    text = (f"{sum(leg.ending == 'ok' for leg in legs)} of {len(legs)} ended well, "
            f"{min(leg.low_m for leg in legs):.2f} to {max(leg.high_m for leg in legs):.2f} m; "
            f"detected {len(late_s)} of {crossed}")
    if len(late_s):
        text += (f" ({np.sum(np.abs(late_s) <= TOLERANCE_S)} within {TOLERANCE_S} s), {late_s.min():.1f} to "
                 f"{late_s.max():.1f} s late")
    return f"{text}; {false} false"


def kept_at(folder: Path, elf: Path, case: Case, seed: int, on: int) -> Path:
    """File of a flight; another image, board or mission has another."""
    what = hashlib.sha256(elf.read_bytes() + repr((case, seed, on)).encode()).hexdigest()
    return folder / f"{what[:16]}.json"


def _leg(elf: Path, case: Case, seed: int, on: int, platform: str, folder: Path | None) -> Leg:
    """Fly once, or take the flight from the folder, and print."""
    path = kept_at(folder, elf, case, seed, on) if folder else None
    if path and path.exists():
        try:
            leg = Leg(**json.loads(path.read_text()))
        except (ValueError, TypeError):
            raise AirTouchError(f"{path} is damaged: delete it, and it is flown again") from None
    else:
        plan = mission(case)
        one = fly(elf, plan, vehicle(platform), seed, parameters={"atHeight.enable": on}, blind_s=case.blind_s)
        low, high = height_range(one)
        last = cruise(one)[-1] if len(cruise(one)) else one.table[-1]
        leg = Leg(one.ending, low, high, crossings(plan, seed, 0, one.table) if case.edges else [],
                  [(t, kind) for t, kind, _ in one.edges], float(last[TRUE_X]), float(last[X]),
                  one.latency_us)
        if path:
            write_bytes(json.dumps(asdict(leg)).encode(), path)
    print(f"{case.name}, seed {seed}, {SETTINGS[on]}: {leg.low_m:.2f} to {leg.high_m:.2f}, {leg.ending} at x "
          f"{leg.end_m:.2f}, its own {leg.own_end_m:.2f}; crossed {words(leg.crossed)}, detected "
          f"{words(leg.reported)}; worst stabilizer {leg.latency_us} us", flush=True)
    return leg


def report(elf: Path, platform: str = "cf2", seeds: int = 1, only: str = "", folder: Path | None = None) -> bool:
    """Fly each case whose name begins so, and print; whether every flight with it ended well.

    folder: where flights are kept, so that a run that was stopped goes on.
    """
    if folder:
        make_folder(folder)
    print(f"true height over the floor, m, of {CRUISE_M} ordered")
    legs: dict[tuple[str, int], list[Leg]] = {}
    for case, seed, on in product(cases(only), range(1, seeds + 1), (0, 1)):
        legs.setdefault((case.name, on), []).append(_leg(elf, case, seed, on, platform, folder))
    for (name, on), flights in legs.items():
        print(f"{name}, {SETTINGS[on]}: {summary(flights)}")
    return all(leg.ending == "ok" for (_, on), flights in legs.items() if on for leg in flights)
