"""The report on a gap: one self-contained HTML page, with a diagnosis or with the measurement alone."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from importlib import resources
from itertools import islice
from pathlib import Path
from typing import Any

import jinja2
import numpy as np

from airtouch import __version__
from airtouch.gap import calibrate, measure, random_effects, words
from airtouch.gap.band_sums import BANDS_HZ
from airtouch.gap.candidates import MEAN, SPECTRUM, Term, term_of
from airtouch.gap.channels import CHANNELS, residual
from airtouch.gap.data import Data, Study
from airtouch.gap.flight import Flight
from airtouch.gap.gap_map import CHANNEL_WORDS, GapMap, gap_map, in_words, short
from airtouch.gap.gap_map import where as where_of
from airtouch.gap.result import Cell, Diagnosis
from airtouch.gap.spectra import AIR, blocks, frequencies, sensor_power, starts
from airtouch.logs.files import write_bytes
from airtouch.logs.flight_log import FlightLog
from airtouch.report import gap_figures, gap_tables
from airtouch.report.write import embed
from airtouch.vehicle import Vehicle

MOST_CELLS = 10  #: in a list
MOST_FLIGHTS = 40  #: looked at for the figures; the diagnosis has seen them all


def write_measurement(path: Path, found: measure.Measurement, flights: Iterable[FlightLog] = (),
                      vehicle: Vehicle | None = None, *, command: str, force: bool = False) -> None:
    """The page of `airtouch gap measure`: map, largest cells, signals and spectra.

    flights, vehicle: what was measured, for the pictures of its signals. Raises
    AirTouchError when the file exists, without `force`.
    """
    seen = list(measure.usable(islice(flights, MOST_FLIGHTS), vehicle, [])) if vehicle else []
    where = found.where
    answer = f"The gap is largest {in_words(where[0])}." if where else "No gap stands out of the floor."
    support = [f"Overall it is {found.gap['before']:.2g} times the floor" +
               (f", {found.gap['calibrated']:.2g} times with the vehicle calibrated on the baseline flights."
                if "calibrated" in found.gap else ".")]
    page = _page(
        title="Gap between flights and simulator", answer=answer, support=support, made=found.map,
        where=where,
        images=(_images(calibrate.declared(vehicle, ()), seen, [], where[0], where) if seen and where else [])
        + _command_image(found.spectra), calibration=gap_tables.named(found.calibration),
        lists=[("Rotor speeds in the air", [words.rotor_in_words(r) for r in found.rotors]),
               ("What these logs cannot say", found.cannot), ("Notes", found.notes),
               ("Left out", found.left_out)],
        flights=_flights(found.flights, found.vehicle, found.baseline), command=command)
    write_bytes(page.encode(), path, force)


def write_diagnosis(path: Path, diagnosis: Diagnosis, flights: Sequence[FlightLog], vehicle: Vehicle,
                    baseline: Sequence[FlightLog] = (), *, command: str, force: bool = False) -> None:
    """The page of `airtouch gap diagnose`: the answer, where, which, before and after, how far.

    flights, vehicle, baseline: what was diagnosed. Raises AirTouchError when the file
    exists, without `force`.
    """
    left_out: list[str] = []
    nominal = list(measure.usable(baseline, vehicle, left_out))
    study, fitted = diagnosis.held or (calibrate.calibrated(vehicle, nominal, scatter=False) if nominal else
                                       (calibrate.declared(vehicle, ()), None))
    seen = list(measure.usable(flights[:MOST_FLIGHTS], vehicle, left_out))
    effects = [term_of(e) for e in diagnosis.effects]
    made = gap_map(study, seen, nominal, effects)
    where = where_of(made)
    if effects and not any(c.after is not None for c in diagnosis.where):
        diagnosis = replace(diagnosis, where=tuple(where))
    shown = words.telling(diagnosis) or (where[0] if where else None)
    page = _page(
        title="Gap between flights and simulator: diagnosis", answer=words.answer(diagnosis),
        support=_support(diagnosis), made=made, where=where, effects=gap_tables.effect_rows(diagnosis),
        ranking=gap_tables.ranking_rows(diagnosis),
        indistinguishable=[f"Cannot be told apart in these logs: {words.joined(list(g))}."
                           for g in diagnosis.indistinguishable],
        images=_images(study, seen, effects, shown, where) + _twin_images(seen, nominal, vehicle),
        how_far=gap_tables.how_far(diagnosis) if diagnosis.effects else None, judged=True,
        unexplained=_unexplained(where),
        calibration=gap_tables.named(fitted.parameters) if fitted else [], advice=diagnosis.advice,
        lists=[("What these logs cannot say", diagnosis.cannot), ("Notes", diagnosis.notes),
               ("Left out", left_out)],
        flights=_flights(diagnosis.flights or [f.name for f in seen], vehicle.name,
                         [f.name for f in nominal]),
        command=command)
    write_bytes(page.encode(), path, force)


def _page(**context: Any) -> str:
    made: GapMap = context.pop("made")
    environment = jinja2.Environment(autoescape=True, trim_blocks=True, undefined=jinja2.StrictUndefined)
    template = environment.from_string((resources.files("airtouch.report") / "gap.html").read_text("utf-8"))
    where: Sequence[Cell] = context.pop("where")
    usual = {"effects": [], "ranking": [], "indistinguishable": [], "how_far": None, "judged": False,
             "unexplained": [], "advice": "", "calibration": []}
    return template.render({
        **usual, **context, "phases": gap_tables.maps(made), "bands": [f"{a:g}-{b:g}" for a, b in BANDS_HZ],
        "legend": gap_tables.LEGEND, "floor_from": made.floor_from, "where": gap_tables.largest_rows(where),
        "has_after": any(c.after is not None for c in made.cells), "version": __version__})


def _support(diagnosis: Diagnosis) -> list[str]:
    """What stands below the answer: probability, shrink, control."""
    lines = []
    first = diagnosis.ranking[0] if diagnosis.ranking else None
    if diagnosis.effects and first is not None:
        lines.append("Named: " + "; ".join(words.effect_in_words(e) for e in diagnosis.effects)
                     + f". Probability of {first.name}: {first.probability:.0%}.")
    if diagnosis.shrink is not None:
        lines.append("On data that the effect was not fitted on, over all channels and bands, it takes away "
                     + words.quantity(diagnosis.shrink, "{:.0%}") + " of the gap above the floor"
                     + _control(diagnosis) + ".")
    return lines


def _control(diagnosis: Diagnosis) -> str:
    shrink = gap_tables.figure(diagnosis.control.get("shrink")) if diagnosis.control else "-"
    name = diagnosis.control.get("name", "a wrong effect") if diagnosis.control else ""
    return "" if shrink == "-" else f"; as a control, {name}, which is wrong, takes away {shrink} of it"


def _unexplained(where: Iterable[Cell]) -> list[str]:
    left = [c for c in where if (c.gap if c.after is None else c.after) > 1.5 * (c.floor_high or c.floor)]
    return [in_words(c) + ("" if c.after is None else
                           f"; with the effects in the model {short(c.after)} {c.unit}")
            for c in left[:MOST_CELLS]]


def _images(study: Study, flights: Sequence[Flight], effects: Sequence[Term], cell: Cell | None,
            where: Sequence[Cell]) -> list[dict[str, str]]:
    """Signals of the cell that tells most, and spectra of the channels with the largest cells."""
    if cell is None or not flights:
        return []
    active = [t.active() for t in effects if t.kind == MEAN]
    band = BANDS_HZ.index(cell.band_hz) if cell.band_hz in BANDS_HZ else len(BANDS_HZ) - 1
    flight = _telling_flight(study, flights, cell)
    before = residual(flight, study.vehicle, study.calibration, study.controller)
    after = None
    if active:
        after = residual(flight, study.vehicle, (*study.calibration, *active), study.controller)
    name = CHANNEL_WORDS[cell.channel].capitalize()
    images = [{"title": f"{name}, up to {BANDS_HZ[band][1]:g} Hz",
               "data": embed(gap_figures.signals(flight, cell.channel, band, before, after, cell.floor)),
               "text": f"Flight {Path(flight.name).name}. Grey: the floor; blue: take-off and landing; "
                       "yellow: over a platform."}]
    channels = gap_tables.shown_channels([cell, *where])
    curves = _curves(study, flights, effects, channels)
    if curves:
        images.append({"title": "Spectra of the gap in the air",
                       "data": embed(gap_figures.spectra(frequencies(AIR), curves)),
                       "text": "Mean over all blocks." + (
                           " A random effect cannot be predicted sample by sample: its green curve is what is "
                           "left of the power." if effects else "")})
    return images


def _telling_flight(study: Study, flights: Sequence[Flight], cell: Cell) -> Flight:
    """The flight in which the channel's gap is in the middle of all flights'."""
    c = [ch.name for ch in CHANNELS].index(cell.channel)
    size = [np.nan_to_num(np.nanstd(residual(f, study.vehicle, study.calibration, study.controller)
                                    [f.usable & (f.phase > 0), c])) for f in flights]
    return flights[int(np.argsort(size)[len(size) // 2])]


def _curves(study: Study, flights: Sequence[Flight], effects: Sequence[Term], channels: Sequence[str],
            ) -> list[dict[str, Any]]:
    active = [t.active() for t in effects if t.kind == MEAN]
    random = [t for t in effects if t.kind == SPECTRUM]
    before, after, added = [], [], 0.0
    for f in flights:
        first = starts(f, AIR)
        if not len(first):
            continue
        for out, some in ((before, ()), (after, active)):
            left = np.where(f.lost[:, None], 0.0, residual(f, study.vehicle, (*study.calibration, *some),
                                                           study.controller))
            out.append((np.abs(blocks(left, first, AIR)) ** 2).mean(axis=0))
        if random:
            data = Data(study, [f])
            added = added + sum(random_effects.power(data, t)[0][AIR].mean(axis=0) for t in random)
    if not before:
        return []
    floor = np.maximum(study.floor.power[AIR] if study.floor.blocks.get(AIR, 0) > 8 else
                       sensor_power(calibrate.sensor_noise(study.vehicle), AIR), 1e-12)
    first, then = np.mean(before, axis=0), np.mean(after, axis=0)
    then = floor + np.abs(then - floor - added / len(before)) if random else then
    index = [ch.name for ch in CHANNELS]
    return [{"channel": name, "unit": CHANNELS[index.index(name)].unit, "before": first[:, index.index(name)],
             "after": then[:, index.index(name)] if effects else None, "floor": floor[:, index.index(name)]}
            for name in channels if np.isfinite(first[:, index.index(name)]).all()]


def _twin_images(flights: Sequence[Flight], nominal: Sequence[Flight], vehicle: Vehicle,
                 ) -> list[dict[str, str]]:
    return _command_image(measure.command_spectra(flights, nominal, vehicle))


def _command_image(made: dict[str, Any]) -> list[dict[str, str]]:
    if not made:
        return []
    return [{"title": "Twin view: spectra of the motor commands", "data": embed(gap_figures.commands(made)),
             "text": "Delays, gains and noise in the loop show here, as a shape that differs."}]


def _flights(names: Sequence[str], vehicle: str, baseline: Sequence[str]) -> str:
    return (f"Flights: {_few(names)}. Vehicle: {vehicle}. "
            + (f"Baseline: {_few(baseline)}." if baseline else "No baseline flights were given."))


def _few(names: Sequence[str]) -> str:
    shown = ", ".join(Path(n).name for n in names[:5])
    return shown + (f" and {len(names) - 5} more" if len(names) > 5 else "")
