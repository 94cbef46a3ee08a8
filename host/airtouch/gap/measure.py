"""Where: the gap of recorded flights to the simulator, before anything is blamed for it."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.gap import callable_module
from airtouch.gap.flights.flight import Flight, ready
from airtouch.gap.flights.hardness import STILL_RAD, hardness_of
from airtouch.gap.loop.command_spectra import block_spectra, frequencies
from airtouch.gap.loop.controller import AXES
from airtouch.gap.nominal import calibrate
from airtouch.gap.nominal.build_study import declared_study
from airtouch.gap.nominal.consistency import differences
from airtouch.gap.result import Cell, Quantity, plain_cell, rounded
from airtouch.gap.signals.spectra import AIR, LENGTH, starts
from airtouch.gap.signals.study import Study
from airtouch.gap.where import summary
from airtouch.gap.where.gap_map import GapMap, Part, assemble, in_words, overall, part_of, where
from airtouch.gap.where.rotor_speeds import rotor_speeds, speeds_over_flights
from airtouch.logs.flight_log import FlightLog
from airtouch.vehicle import Vehicle


@dataclass(frozen=True)
class Measurement:
    """The gap map with its largest cells, and what these logs cannot say.

    gap: rms over the floor of all cells in the air, for the vehicle as declared and, with
    baseline flights, as calibrated on them; spectra: of the commands, as flown and as
    nominal flights have them (command view), N^2/Hz.
    """

    vehicle: str
    map: GapMap
    where: tuple[Cell, ...]
    gap: Mapping[str, float]
    flights: tuple[str, ...]
    baseline: tuple[str, ...] = ()
    calibration: Mapping[str, Quantity] = field(default_factory=dict)
    spectra: Mapping[str, Any] = field(default_factory=dict)
    rotors: tuple[Mapping[str, float], ...] = ()  #: speeds as logged and as modelled, in the air, 1/min
    notes: tuple[str, ...] = ()
    cannot: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()

    def plain(self) -> dict[str, Any]:
        """JSON-ready: `where` as in the diagnosis, `map` with every cell."""
        return rounded({
            "vehicle": self.vehicle, "flights": list(self.flights), "baseline": list(self.baseline),
            "where": [plain_cell(c) | {"words": in_words(c)} for c in self.where],
            "gap": dict(self.gap), "floor_from": self.map.floor_from,
            "calibration": {k: q.plain() for k, q in self.calibration.items()},
            "cannot": list(self.cannot), "notes": list(self.notes), "left_out": list(self.left_out),
            "rotors": [dict(r) for r in self.rotors], "spectra": dict(self.spectra),
            "map": [plain_cell(c) for c in self.map.cells],
        })


@dataclass(frozen=True)
class MeasuredFlight:
    """One flight held against the model of each study.

    parts: of the map of each study; power (bins, 4): `_command_power`; speeds (2, 4): `rotor_speeds`, 1/min; notes,
    cannot: of the `Flight`.
    """

    parts: tuple[Part, ...]
    power: np.ndarray
    speeds: np.ndarray | None
    notes: tuple[str, ...]
    cannot: tuple[str, ...]


def measure(flights: Iterable[FlightLog], vehicle: Vehicle, baseline: Iterable[FlightLog] = (), *,
            calibrated: bool = True, progress: Callable[[str], None] = lambda _: None,
            run: Callable = map) -> Measurement:
    """Hold flights against the vehicle's model and map what is left.

    Flights that cannot be used are left out with their reason; raises AirTouchError when
    none is left. Works from accelerations and motor commands; `cannot` says what more
    channels would show. Where `flights` reads them as it goes, one is in memory at a time.
    calibrated: whether the vehicle is also calibrated on the baseline, for the second arm;
    run: what maps a function over flights, in place of `map`, to spread the work.
    """
    left_out: list[str] = []
    nominal = list(usable(baseline, vehicle, left_out))
    studies, fitted = [declared_study(vehicle, nominal)], None
    notes = differences(studies[0], nominal)
    if nominal and calibrated:
        progress("calibration")
        study, fitted = calibrate.calibrated(vehicle, nominal, scatter=False)
        studies.append(study)
        notes += [n for n in fitted.notes if n not in notes]
    measured = _measured(studies, flights, run, progress, left_out)
    maps = [assemble(study, [m.parts[i] for m in measured], [part_of(study, f) for f in nominal])
            for i, study in enumerate(studies)]
    gap = {"before": overall(maps[0].cells), "floor": 1.0}
    if len(maps) > 1:
        gap["calibrated"] = overall(maps[1].cells)
    notes += [f"{m.parts[0].name}: {n}" for m in measured for n in m.notes]
    first = summary.headline(maps[0].cells)
    return Measurement(
        vehicle.name, maps[0], tuple(dict.fromkeys([c for c in (first,) if c is not None] + where(maps[0]))), gap,
        maps[0].flights, tuple(f.name for f in nominal), fitted.parameters if fitted else {},
        _spectra([m.power for m in measured], [_command_power(f, vehicle) for f in nominal]),
        speeds_over_flights([m.speeds for m in measured]), tuple(notes),
        cannot_of([m.cannot for m in measured]), tuple(left_out))


def _measured(studies: Sequence[Study], flights: Iterable[FlightLog], run: Callable, progress: Callable[[str], None],
              left_out: list[str]) -> list[MeasuredFlight]:
    """Each flight that can be used against the model of each study; reasons of the others are added to `left_out`.

    Raises AirTouchError when no flight can be used.
    """
    measured: list[MeasuredFlight] = []
    for one in run(partial(measured_flight, tuple(studies)), flights):
        if isinstance(one, str):
            left_out.append(one)
        else:
            progress(one.parts[0].name)
            measured.append(one)
    if not measured:
        raise AirTouchError(left_out[0] if len(left_out) == 1 else "no flight that can be used" +
                            (f" of {len(left_out)}; the first: {left_out[0]}" if left_out else ""))
    return measured


def measured_flight(studies: Sequence[Study], log: FlightLog) -> MeasuredFlight | str:
    """One flight against the model of each study, or the reason why it cannot be used."""
    try:
        flight = ready(log, studies[0].vehicle)
    except AirTouchError as error:
        return str(error)
    return MeasuredFlight(tuple(part_of(s, flight) for s in studies), _command_power(flight, studies[0].vehicle),
                rotor_speeds(flight, studies[0]), flight.notes, flight.cannot)


def usable(logs: Iterable[FlightLog], vehicle: Vehicle, left_out: list[str]) -> Iterator[Flight]:
    """Flights made ready, one at a time; the reasons of those that cannot be go to `left_out`."""
    for log in logs:
        try:
            yield ready(log, vehicle)
        except AirTouchError as error:
            left_out.append(str(error))


def flown_unlike(study: Study, flights: Sequence[Flight]) -> list[str]:
    """In words, which flights are flown harder or calmer than every baseline flight: their floor is extrapolated."""
    slopes = study.floor.slopes
    if slopes is None:
        return []
    notes = []
    for f in flights:
        hardness = hardness_of(f, starts(f, AIR), LENGTH[AIR])
        middle = float(np.median(hardness)) if len(hardness) else slopes.usual
        if not slopes.calmest <= middle <= slopes.hardest:
            word, end = ("harder", slopes.hardest) if middle > slopes.hardest else ("calmer", slopes.calmest)
            own, theirs = (np.degrees(STILL_RAD * np.sqrt(np.expm1(2.0 * max(x, 0.0)))) for x in (middle, end))
            notes.append(f"{f.name}: flown {word} than any baseline flight (its tilt varies by {own:.1f} degrees, "
                         "theirs by "
                         f"{'at most' if word == 'harder' else 'at least'} {theirs:.1f}): the floor is extrapolated; "
                         "fly the baseline like the test")
    return notes


def cannot_of(flights: Sequence[Sequence[str]]) -> tuple[str, ...]:
    """What logs cannot say, each reason once, with the number of flights where it is not all. flights: reasons of each.
    """
    count = Counter(reason for one in flights for reason in one)
    return tuple(r if n == len(flights) else f"{n} of {len(flights)} flights: {r}" for r, n in count.items())


def command_spectra(flights: Iterable[Flight], nominal: Iterable[Flight], vehicle: Vehicle) -> dict[str, Any]:
    """The command view: mean spectra of the commands, as flown and as nominal flights have them."""
    return _spectra(*([_command_power(f, vehicle) for f in some] for some in (flights, nominal)))


def _command_power(flight: Flight, vehicle: Vehicle) -> np.ndarray:
    """Sum of the commands' spectra over blocks and their number, (bins, 4): three axes and the count."""
    blocks = block_spectra(flight, vehicle)[1]
    power = (np.abs(blocks) ** 2).sum(axis=0)
    return np.column_stack([power, np.full(len(power), float(len(blocks)))])


def _spectra(flown: Sequence[np.ndarray], nominal: Sequence[np.ndarray]) -> dict[str, Any]:
    """The command view: mean spectra of the commands, empty without a steady stretch in flight.

    flown, nominal: `_command_power` (bins, 4) of each flight.
    """
    total = np.sum(flown, axis=0)
    if not len(flown) or not total[0, -1]:
        return {}
    made: dict[str, Any] = {"unit": "N^2/Hz", "frequency_hz": frequencies().tolist()}
    of_nominal = np.sum(nominal, axis=0) if len(nominal) else None
    for i, axis in enumerate(AXES):
        made[axis] = {"flown": (total[:, i] / total[0, -1]).tolist()}
        if of_nominal is not None and of_nominal[0, -1]:
            made[axis]["nominal"] = (of_nominal[:, i] / of_nominal[0, -1]).tolist()
    return made


callable_module(__name__)
