"""Where: the gap of recorded flights to the simulator, before anything is blamed for it."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.gap.answer.curves import MOST_FLIGHTS, Curves, curves_of
from airtouch.gap.flights.fitness import cannot_of, notes_of
from airtouch.gap.flights.flight import (
    GYRO_UNUSED,
    Flight,
    none_usable,
    ready,
    ready_flights,
    with_gyro_if_any,
    without_gyro,
)
from airtouch.gap.nominal import calibrate
from airtouch.gap.nominal.build_study import declared_study
from airtouch.gap.nominal.consistency import differences
from airtouch.gap.result import Quantity, rounded
from airtouch.gap.study import Study
from airtouch.gap.where import summary
from airtouch.gap.where.cell import Cell, plain_cell
from airtouch.gap.where.cell_words import in_words, short
from airtouch.gap.where.command_power import MeanSpectra, SummedPower, command_power, mean_spectra
from airtouch.gap.where.gap_map import GapMap, Part, assemble, part_of
from airtouch.gap.where.rotor_speeds import RotorSpeed, rotor_speeds, speeds_over_flights
from airtouch.logs.flight_log import GYRO, FlightLog
from airtouch.logs.segments import KINDS
from airtouch.vehicle import Vehicle, name_in, other_baseline


@dataclass(frozen=True)
class Measurement:
    """The gap map with its largest cells, and what these logs cannot say.

    gap: rms over the floor of all cells in the air, for the vehicle as declared and, with baseline flights, as
    calibrated on them; calibration: those parameters; spectra: of the commands, None without a steady stretch in
    flight; rotors: speeds as logged and as modelled, in the air, 1/min; left_out: reasons why
    flights were not used; study: what the map holds them against; nominal: the baseline flights, whose floor the
    curves show; curves: of `curves_of_measurement`, where they were asked for; uses_gyro: whether a gyro that the
    flights have is used, as it is where the baseline has one.
    """

    vehicle: str
    map: GapMap
    where: tuple[Cell, ...]
    gap: Mapping[str, float]
    flights: tuple[str, ...]
    baseline: tuple[str, ...] = ()
    calibration: Mapping[str, Quantity] = field(default_factory=dict)
    spectra: MeanSpectra | None = field(default=None, compare=False)
    rotors: tuple[RotorSpeed, ...] = ()
    notes: tuple[str, ...] = ()
    cannot: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    study: Study | None = field(default=None, compare=False, repr=False)
    nominal: tuple[Flight, ...] = field(default=(), compare=False, repr=False)
    curves: Curves | None = field(default=None, compare=False, repr=False)
    uses_gyro: bool = field(default=True, compare=False, repr=False)

    @property
    def headline(self) -> Cell | None:
        """The cell that the answer speaks of, the first of `where`; None where no cell stands out."""
        return self.where[0] if self.where else None

    @property
    def sentences(self) -> tuple[str, str]:
        """Where most of the gap lies, and how large all of it is."""
        where = f"Most of the gap lies {in_words(self.headline)}." if self.headline else \
            "No gap stands out from the floor."
        if not np.isfinite(self.gap["before"]):
            return where, "How large it is over all is not known: no cell of the map is in the air."
        calibrated = f", {short(self.gap['calibrated'])} times with the vehicle calibrated on the baseline flights." \
            if "calibrated" in self.gap else "."
        return where, f"Overall it is {short(self.gap['before'])} times the floor{calibrated}"

    def plain(self) -> dict[str, Any]:
        """JSON-ready, the keys of host/docs/gap-json.md: `where` as in the diagnosis with `words`, `map` all cells."""
        return rounded({
            "vehicle": self.vehicle, "flights": list(self.flights), "baseline": list(self.baseline),
            "where": [plain_cell(c) | {"words": in_words(c)} for c in self.where],
            "gap": dict(self.gap), "floor_from": self.map.floor_from,
            "calibration": {k: q.plain() for k, q in self.calibration.items()},
            "cannot": list(self.cannot), "notes": list(self.notes), "left_out": list(self.left_out),
            "rotors": [r._asdict() for r in self.rotors],
            "spectra": self.spectra.plain() if self.spectra is not None else {},
            "map": [plain_cell(c) for c in self.map.cells],
        })


@dataclass(frozen=True)
class MeasuredFlight:
    """One flight held against the model of each study.

    parts: of the map of each study; power: of its commands; speeds (2, 4): `rotor_speeds`, 1/min; notes, cannot: of the
    `Flight`; has_gyro: whether it has one; vehicle: that its log names.
    """

    parts: tuple[Part, ...]
    power: SummedPower
    speeds: np.ndarray | None
    notes: tuple[str, ...]
    cannot: tuple[str, ...]
    has_gyro: bool
    vehicle: str

    @property
    def name(self) -> str:
        """Of the flight."""
        return self.parts[0].name


def measure(flights: Iterable[FlightLog], vehicle: Vehicle, baseline: Iterable[FlightLog] = (), *,
            calibrated: bool = True, progress: Callable[[str], None] = lambda _: None,
            mapper: Callable = map) -> Measurement:
    """Hold flights against the vehicle's model and map what is left.

    Flights that cannot be used are left out with their reason; raises AirTouchError when
    none is left. Works from accelerations and motor commands; `cannot` says what more
    channels would show. Where `flights` reads them as it goes, one is in memory at a time.
    calibrated: whether the vehicle is also calibrated on the baseline, for the second arm;
    mapper: what maps a function over flights, in place of `map`, to spread the work.
    """
    of_baseline: list[str] = []
    left_out: list[str] = []
    nominal = with_gyro_if_any(list(ready_flights(baseline, vehicle, of_baseline)), of_baseline)
    fitted = None
    if nominal and calibrated:
        progress("calibration")
        study, fitted = calibrate.calibrated(vehicle, nominal, scatter=False)
        nominal, studies = list(fitted.flights), [fitted.declared, study]
    else:
        studies = [declared_study(vehicle, nominal)]
    notes = list(dict.fromkeys([*differences(studies[0], nominal), *(fitted.notes if fitted else ())]))
    uses_gyro = not nominal or nominal[0].has_gyro
    measured = _measured(partial(measured_flight, tuple(studies), uses_gyro=uses_gyro), flights, mapper, progress,
                         left_out)
    maps = [assemble(study, [m.parts[i] for m in measured], [part_of(study, f) for f in nominal])
            for i, study in enumerate(studies)]
    gap = {"before": summary.overall(maps[0].cells), "floor": 1.0}
    if len(maps) > 1:
        gap["calibrated"] = summary.overall(maps[1].cells)
    notes = [*notes_of([(m.name, m.notes) for m in measured]),
             *notes_of([(f.name, f.notes) for f in nominal], "baseline flights"),
             *other_baseline([m.vehicle for m in measured], [name_in(f.log.meta) for f in nominal]), *notes]
    first = summary.headline(maps[0].cells)
    return Measurement(
        vehicle=vehicle.name, map=maps[0], gap=gap,
        where=tuple(dict.fromkeys([c for c in (first,) if c is not None] + summary.cells_to_show(maps[0]))),
        flights=maps[0].flights, baseline=tuple(f.name for f in nominal),
        calibration=fitted.parameters if fitted else {},
        spectra=mean_spectra([m.power for m in measured], [command_power(f, vehicle) for f in nominal]),
        rotors=speeds_over_flights([m.speeds for m in measured]), notes=tuple(notes),
        cannot=cannot_of([m.cannot for m in measured]), left_out=(*of_baseline, *left_out), study=studies[0],
        nominal=tuple(nominal[:MOST_FLIGHTS]), uses_gyro=uses_gyro)


def _measured(measure_one: Callable[[FlightLog], MeasuredFlight | str], flights: Iterable[FlightLog], mapper: Callable,
              progress: Callable[[str], None], left_out: list[str]) -> list[MeasuredFlight]:
    """Each flight that can be used as `measure_one` measures it, those with a gyro if any has.

    The reasons of the others are added to `left_out`. Raises AirTouchError when no flight can be used.
    """
    measured: list[MeasuredFlight] = []
    for one in mapper(measure_one, flights):
        if isinstance(one, str):
            left_out.append(one)
        else:
            progress(one.name)
            measured.append(one)
    if not measured:
        raise none_usable(left_out)
    return with_gyro_if_any(measured, left_out)


def measured_flight(studies: Sequence[Study], log: FlightLog, uses_gyro: bool = True) -> MeasuredFlight | str:
    """One flight against the model of each study, with its gyro or without it, or the reason why it cannot be used."""
    unused = not uses_gyro and log.has(*GYRO)
    try:
        flight = ready(without_gyro(log) if unused else log, studies[0].vehicle)
    except AirTouchError as error:
        return str(error)
    if unused:
        flight = replace(flight, notes=(*flight.notes, GYRO_UNUSED))
    return MeasuredFlight(tuple(part_of(s, flight) for s in studies), command_power(flight, studies[0].vehicle),
                          rotor_speeds(flight, studies[0]), flight.notes, flight.cannot, flight.has_gyro,
                          name_in(log.meta))


def curves_of_measurement(measurement: Measurement, logs: Iterable[FlightLog], vehicle: Vehicle) -> Curves:
    """The curves of a measurement, of MOST_FLIGHTS flights: first those that have the phase of the headline's cell."""
    if not measurement.where:
        return Curves(commands=measurement.spectra)
    usable = ready_flights((log if measurement.uses_gyro else without_gyro(log) for log in logs), vehicle, [])
    flights = with_gyro_if_any(_first_with(KINDS.index(measurement.where[0].phase), usable), [])
    if not flights:
        return Curves(commands=measurement.spectra)
    curves = curves_of(measurement.study or declared_study(vehicle, ()), flights, measurement.nominal, [],
                       measurement.where, measurement.map.cells)
    return replace(curves, commands=measurement.spectra)


def _first_with(phase: int, flights: Iterator[Flight]) -> list[Flight]:
    """The first MOST_FLIGHTS flights with a phase, filled up by the first without; reads no more than it needs."""
    with_phase: list[Flight] = []
    without_phase: list[Flight] = []
    while len(with_phase) < MOST_FLIGHTS and (flight := next(flights, None)) is not None:
        group = with_phase if phase in flight.phase else without_phase
        if len(group) < MOST_FLIGHTS:
            group.append(flight)
    return (with_phase + without_phase)[:MOST_FLIGHTS]
