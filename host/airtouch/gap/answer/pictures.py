"""The curves of a report, computed where everything else is: signals of the headline's cell, spectra, commands."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice
from typing import Any

import numpy as np

from airtouch.gap import measure
from airtouch.gap.evidence import random_effects
from airtouch.gap.evidence.data import Data, Study
from airtouch.gap.flights.flight import GROUND, PERIOD_S, Flight
from airtouch.gap.nominal import calibrate
from airtouch.gap.result import Cell
from airtouch.gap.signals.channels import CHANNELS, TORQUE, residual
from airtouch.gap.signals.spectra import AIR, blocks, frequencies, sensor_power, starts
from airtouch.gap.signatures.candidates import MEAN, Term, random_of
from airtouch.gap.where.band_sums import BANDS_HZ, filtered, stretches
from airtouch.logs.flight_log import FlightLog
from airtouch.vehicle import Vehicle

MOST_FLIGHTS = 40  #: looked at for the curves
MOST_SPECTRA = 3
PLACE = {c.name: i for i, c in enumerate(CHANNELS)}


@dataclass(frozen=True)
class Signal:
    """One channel of one flight up to the band's end, each (n,), NaN where nothing is judged.

    measured: None where no sensor shows it alone; before, after: what the model leaves, without and with the effects.
    """

    flight: str
    channel: str
    band_hz: tuple[float, float]
    unit: str
    time_s: np.ndarray
    phase: np.ndarray
    measured: np.ndarray | None
    before: np.ndarray
    after: np.ndarray | None
    floor: float


@dataclass(frozen=True)
class Spectrum:
    """Power spectral densities (bins,) of one channel's gap in the air."""

    channel: str
    unit: str
    before: np.ndarray
    after: np.ndarray | None
    floor: np.ndarray


@dataclass(frozen=True)
class Pictures:
    """Every curve of a report."""

    signal: Signal | None = None
    frequency_hz: np.ndarray = field(default_factory=lambda: np.zeros(0))
    spectra: tuple[Spectrum, ...] = ()
    commands: Mapping[str, Any] = field(default_factory=dict)  #: `measure.command_spectra`


def of(study: Study, flights: Sequence[Flight], nominal: Sequence[Flight], effects: Sequence[Term],
       headline: Cell | None, cells: Sequence[Cell]) -> Pictures:
    """The curves of a diagnosis: headline is the cell that its answer speaks of."""
    commands = measure.command_spectra(flights, nominal, study.vehicle)
    if headline is None or not flights:
        return Pictures(commands=commands)
    some = flights[:MOST_FLIGHTS]
    channels = list(dict.fromkeys(c.channel for c in (headline, *cells)))[:MOST_SPECTRA]
    return Pictures(_signal(study, _telling_flight(study, some, headline), effects, headline), frequencies(AIR),
                    _spectra(study, some, effects, channels), commands)


def of_measurement(found: measure.Measurement, logs: Iterable[FlightLog], vehicle: Vehicle) -> Pictures:
    """The curves of a measurement, of its first flights."""
    seen = list(measure.usable(islice(logs, MOST_FLIGHTS), vehicle, [])) if found.where else []
    if not seen:
        return Pictures(commands=found.spectra)
    made = of(calibrate.declared(vehicle, ()), seen, [], [], found.where[0], found.where)
    return Pictures(made.signal, made.frequency_hz, made.spectra, found.spectra)


def _left(study: Study, flight: Flight, effects: Sequence[Any] = ()) -> np.ndarray:
    return residual(flight, study.vehicle, (*study.calibration, *effects), study.controller)


def _signal(study: Study, flight: Flight, effects: Sequence[Term], cell: Cell) -> Signal:
    active = [t.active() for t in effects if t.kind == MEAN]
    band = BANDS_HZ.index(cell.band_hz) if cell.band_hz in BANDS_HZ else 0
    c = PLACE[cell.channel]
    measured = _measured(flight, c)
    def below(values):
        return None if values is None else _below(flight, values, band)
    return Signal(flight.name, cell.channel, cell.band_hz, CHANNELS[c].unit, np.arange(len(flight)) * PERIOD_S,
                  flight.phase, below(measured), below(_left(study, flight)[:, c]),
                  below(_left(study, flight, active)[:, c]) if active else None, cell.floor)


def _telling_flight(study: Study, flights: Sequence[Flight], cell: Cell) -> Flight:
    """The flight in which the channel's gap is in the middle of all flights'."""
    c = PLACE[cell.channel]
    size = [np.nan_to_num(np.nanstd(_left(study, f)[f.usable & (f.phase != GROUND), c])) for f in flights]
    return flights[int(np.argsort(size)[len(size) // 2])]


def _measured(flight: Flight, channel: int) -> np.ndarray | None:
    if channel < 3:
        return flight.acceleration[:, channel]
    if TORQUE.start <= channel < TORQUE.stop and flight.rates is not None:
        return np.diff(flight.rates[:, channel - 3], append=flight.rates[-1:, channel - 3]) / PERIOD_S
    return None


def _below(flight: Flight, values: np.ndarray, band: int) -> np.ndarray:
    """Values up to the end of a band, NaN where nothing is judged."""
    out = np.full(len(values), np.nan)
    for start, stop in stretches(flight):
        here = values[start:stop]
        if band < len(BANDS_HZ) - 1:
            here = filtered(np.nan_to_num(here[:, None]))[:max(band, 1) + 1].sum(axis=0)[:, 0]
        out[start:stop] = here
    return out


def _spectra(study: Study, flights: Sequence[Flight], effects: Sequence[Term], channels: Sequence[str],
             ) -> tuple[Spectrum, ...]:
    """Means over all blocks in the air. Of a random effect the power is taken off, as no sample can be predicted."""
    active = [t.active() for t in effects if t.kind == MEAN]
    random = random_of(effects)
    before, after, added = [], [], 0.0
    for f in flights:
        first = starts(f, AIR)
        if not len(first):
            continue
        for out, some in ((before, ()), (after, active)):
            left = np.where(f.lost[:, None], 0.0, _left(study, f, some))
            out.append((np.abs(blocks(left, first, AIR)) ** 2).mean(axis=0))
        if random:
            data = Data(study, [f])
            added = added + sum(random_effects.power(data, t)[0][AIR].mean(axis=0) for t in random)
    if not before:
        return ()
    floor = np.maximum(study.floor.power[AIR] if study.floor.blocks.get(AIR, 0) > 8 else
                       sensor_power(calibrate.sensor_noise(study.vehicle), AIR), 1e-12)
    one, two = np.mean(before, axis=0), np.mean(after, axis=0)
    two = floor + np.abs(two - floor - added / len(before)) if random else two
    return tuple(Spectrum(name, CHANNELS[PLACE[name]].unit, one[:, PLACE[name]],
                          two[:, PLACE[name]] if effects else None, floor[:, PLACE[name]])
                 for name in channels if np.isfinite(one[:, PLACE[name]]).all())
