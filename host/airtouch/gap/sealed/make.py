"""Sealed sets: flights whose effect is withheld, so that nobody, this package included, can look.

A set is a folder: `vehicle.toml`, `cal_*` flights free of effects, `flight_*` flights whose effect is drawn, and
`sealed.json` with the SHA-256 of the key (`key`). The key lies apart, in `FOLDER.key.json` beside the folder.
"""

import re
import secrets
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib import resources
from itertools import combinations, islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.gap.evidence.data import Data
from airtouch.gap.flights.flight import ready_flights
from airtouch.gap.nominal import calibrate
from airtouch.gap.sealed.key import ANSWERS, OPENED, SEALED, DrawnEffect, DrawnFlight, Key, key_path, seal
from airtouch.gap.sealed.severity import Conditions, all_flown, log_ratio, three_severities, weakest
from airtouch.gap.second_process import map_on_two_cores
from airtouch.gap.signatures.alike import interchangeable
from airtouch.gap.signatures.random_draws import KINDS
from airtouch.gap.study import Study
from airtouch.logs.files import write, write_bytes
from airtouch.logs.flight_log import FlightLog
from airtouch.simulation.batch import flights as flown
from airtouch.simulation.effects import Active, get
from airtouch.simulation.flight import Diverged
from airtouch.vehicle import Vehicle, load

SCENARIO, VEHICLE = "diagnosis", "crazyflie-2.1-flow"
CAL, NONE = 6, 8  #: flights free of effects, to calibrate on and for the severities; chosen
SHARES = {"single": 0.42, "none": 0.42}  #: of all flights; the rest have two effects; chosen
PAIR_SEVERITIES = (1, 2)  #: places among the severities of the effects of a pair: not the weakest; chosen
HIDDEN = ("vbat_V", "rpm_1", "rpm_2", "rpm_3", "rpm_4")  #: columns that logs of small vehicles seldom have
ANEW = 10_000  #: added to the number of a flight for each time that it is drawn anew
AT_ONCE = 4  #: kinds of effects whose severities two processes share at a time; chosen
MOST_FLOWN = 10  #: flights flown for each that is to end well; chosen
TRIES, WEAKER = 20, 0.9  #: flights drawn anew after a crash, each with so much of the strength; chosen
NONE_FIRST, CAL_FIRST = 800_000, 700_000  #: numbers of flights for the severities, and to calibrate on
UNSEALED = "unsealed"  #: file in the folder of a set that is being made; what is left of one that was broken off
OWN_NAME = re.compile(r"(flight|cal)_\d+\.csv\.gz")  #: of the flights of a set
Say = Callable[[str], None]
Severities = Mapping[str, Sequence[float]]  #: of each kind of effect, its three strengths in rising order


class Draw(NamedTuple):
    """A kind of effect and the place of its severity, 0 to 2."""

    kind: str
    level: int


class Plan(NamedTuple):
    """What the flights of a set are drawn for: the vehicle, the severities of each kind, the set's seed."""

    vehicle: Vehicle
    severities: Severities
    seed: int


def make(out: Path, flights: int, seed: int = 0, *, key: Path | None = None, force: bool = False,
         kinds: Sequence[str] | None = None, progress: Say = lambda _: None) -> Path:
    """Write a sealed set to the folder `out` and its key apart; returns the key's path.

    kinds: of `random_draws.KINDS` to draw from, all of them by default. Raises AirTouchError for others, and when there
    is a set, a key or a flight already and `force` is not given, but for flights of a set that was broken off.
    """
    out, key = Path(out), Path(key) if key else key_path(Path(out))
    if strange := sorted(set(kinds or ()) - set(KINDS)):
        raise AirTouchError(f"{', '.join(strange)}: no kind of effect that is drawn; there are {', '.join(KINDS)}")
    _clear(out, key, force)
    vehicle = load(VEHICLE)
    write_bytes((resources.files("airtouch") / "vehicles" / f"{VEHICLE}.toml").read_bytes(), out / "vehicle.toml", True)
    progress("nominal flights")
    cal = nominal(vehicle, CAL_FIRST, CAL, seed)
    for i, log in enumerate(cal):
        write(log, out / f"cal_{i}.csv.gz", force=True)
    progress("calibration")
    study = calibrated_study(vehicle, cal)
    plan = Plan(vehicle, severities_of(study, seed, kinds, progress), seed)
    rng = np.random.default_rng([seed, 1])
    flown_with: dict[str, DrawnFlight] = {}
    for number, draws in enumerate(draw(flights, plan.severities, rng)):
        name = f"flight_{number:04d}"
        progress(f"{name}, of {flights}")
        log, effects = _flight(plan, number, draws, rng)
        write(log, out / f"{name}.csv.gz", force=True)
        flown_with[name] = DrawnFlight(effects, _log_ratio_of_one(study, log, effects))
    drawn = {"salt": secrets.token_hex(16), "seed": seed, "scenario": SCENARIO, "vehicle": VEHICLE}
    seal(out, key, Key(flown_with, plan.severities, drawn), CAL)
    (out / UNSEALED).unlink()
    return key


def _clear(out: Path, key: Path, force: bool) -> None:
    """Make the folder of a set; the flights of one that was broken off are deleted, with force those of any set.

    The seal and the key go first: of a set that is broken off later nothing is left to score it by. Raises
    AirTouchError where there is a set, a key or a flight and neither is the case.
    """
    for path in (out / SEALED, key):
        if path.exists() and not force:
            raise AirTouchError(f"{path}: exists already; use --force to replace it")
    out.mkdir(parents=True, exist_ok=True)
    old = [path for path in out.iterdir() if OWN_NAME.fullmatch(path.name)]
    if old and not force and not (out / UNSEALED).exists():
        raise AirTouchError(f"{out}: flights of no sealed set are in it; choose another folder, or replace them with "
                            "`airtouch gap blind make --force`")
    for path in (out / SEALED, key, out / OPENED, *old, *(out / ANSWERS).glob("flight_*.json")):
        path.unlink(missing_ok=True)
    write_bytes(b"", out / UNSEALED, True)


def _log_ratio_of_one(study: Study, log: FlightLog, effects: Sequence[DrawnEffect]) -> float | None:
    """`severity.log_ratio` of a flight with one effect alone, nats; None with another number of effects."""
    if len(effects) != 1:
        return None
    active = Active(get(effects[0].name), effects[0].values)
    return log_ratio(Data(study, list(ready_flights([log], study.vehicle, []))), active)


def stripped(log: FlightLog) -> FlightLog:
    """A log that says nothing of how it came about."""
    kept: dict[str, Any] = {k: log.meta[k] for k in ("sample_period_s", "acc_frame") if k in log.meta}
    return FlightLog({k: v for k, v in log.columns.items() if k not in HIDDEN}, {**kept, "vehicle": VEHICLE})


def nominal(vehicle: Vehicle, first: int, count: int, seed: int) -> list[FlightLog]:
    """Flights free of effects that end well, from a number on; AirTouchError is raised where too few of them do."""
    flights = flown(SCENARIO, range(first, first + MOST_FLOWN * count), vehicle=vehicle, seed=seed, workers=1)
    return ending_well(flights, count, f"{SCENARIO}: of {MOST_FLOWN * count} flights without an effect")


def ending_well(flights: Iterable[FlightLog | Diverged], count: int, what: str) -> list[FlightLog]:
    """The first flights that end well, `stripped`; AirTouchError where fewer than count do. what: flights, in words."""
    logs = [stripped(log) for log in islice((x for x in flights if isinstance(x, FlightLog)), count)]
    if len(logs) < count:
        raise AirTouchError(f"{what} {len(logs)} end well, fewer than {count}")
    return logs


def severities_of(study: Study, seed: int, kinds: Sequence[str] | None = None, progress: Say = lambda _: None,
                  ) -> dict[str, tuple[float, ...]]:
    """Three severities of each kind of effect that such flights show at all, in the unit of the kind's strength."""
    vehicle = study.vehicle
    logs = nominal(vehicle, NONE_FIRST, NONE, seed)
    without = [Data(study, list(ready_flights([log], vehicle, []))) for log in logs]
    conditions = Conditions(study, SCENARIO, without, stripped)
    asked = [name for name in KINDS if kinds is None or name in kinds]
    lowest: list[float | None] = []
    for first in range(0, len(asked), AT_ONCE):
        names = asked[first:first + AT_ONCE]
        for number, name in enumerate(names, first + 1):
            progress(f"severities of {name}, effect {number} of {len(asked)}")
        lowest += map_on_two_cores(lambda name: weakest(KINDS[name], conditions, seed), names)
    return {name: three_severities(low, KINDS[name].highest)
            for name, low in zip(asked, lowest, strict=True) if low is not None}


def calibrated_study(vehicle: Vehicle, cal: Sequence[FlightLog]) -> Study:
    """What flights of a set are held against."""
    return calibrate.calibrated(vehicle, list(ready_flights(cal, vehicle, [])))[0]


def draw(count: int, severities: Severities, rng: np.random.Generator) -> list[list[Draw]]:
    """What is drawn for each flight: one kind of effect, two or none, in random order.

    Raises AirTouchError where the kinds give no single effect or no pair.
    """
    singles, none = (round(count * SHARES[k]) for k in ("single", "none"))
    names = list(severities)
    draws = [Draw(n, level) for level in range(3) for n in names]
    if not names:
        raise AirTouchError("no effect is strong enough to be drawn; give other kinds")
    if count > singles + none and not any(_may_pair(a, b) for a, b in combinations(names, 2)):
        raise AirTouchError(f"{', '.join(names)}: no two of them make a pair; give more kinds")
    cases: list[list[Draw]] = []
    while len(cases) < singles:  # every kind at every severity equally often
        cases += [[draws[i]] for i in rng.permutation(len(draws))][:singles - len(cases)]
    for _ in range(count - singles - none):
        while True:
            a, b = (names[i] for i in rng.choice(len(names), 2, replace=False))
            if _may_pair(a, b):
                break
        cases.append([Draw(n, int(rng.choice(PAIR_SEVERITIES))) for n in (a, b)])
    cases += [[] for _ in range(none)]
    return [cases[i] for i in rng.permutation(len(cases))]


def _may_pair(a: str, b: str) -> bool:
    """Whether two kinds are of two effects that logs can tell apart."""
    return KINDS[a].effect != KINDS[b].effect and not interchangeable(KINDS[a].effect, KINDS[b].effect)


def _flight(plan: Plan, number: int, draws: Sequence[Draw], rng: np.random.Generator,
            ) -> tuple[FlightLog, tuple[DrawnEffect, ...]]:
    """The flight of a number that ends well, and what acts in it: after a crash another one, a little weaker.

    A vehicle that comes to stand on the platform has crashed too (`severity.all_flown`). Raises AirTouchError where
    TRIES flights crash.
    """
    for attempt in range(TRIES):
        active: list[Active] = [KINDS[d.kind].active(plan.severities[d.kind][d.level] * WEAKER ** attempt, rng)
                                for d in draws]
        log = next(iter(flown(SCENARIO, [number + ANEW * attempt], vehicle=plan.vehicle, effects=active,
                              seed=plan.seed, workers=1)))
        if isinstance(log, FlightLog) and all_flown(list(ready_flights([stripped(log)], plan.vehicle, []))):
            return stripped(log), tuple(DrawnEffect(a.effect.name, d.kind, d.level, dict(a.values))
                                        for a, d in zip(active, draws, strict=True))
    raise AirTouchError(f"{', '.join(d.kind for d in draws)}: {TRIES} flights crashed; lower its highest strength")
