"""The functions of `import airtouch as at`.

`at.read`, `at.write`, `at.to_pandas`, `at.from_pandas`, `at.detect`, `at.evaluate`, `at.simulate`, `at.adapt`,
`at.gap.diagnose`, `at.gap.measure` and `at.gap.plots`. A flight is a file name, a `FlightLog` or a pandas table with
the log's column names; `at.adapt` takes files and folders alone. Heavy modules are imported at their first use, so
`import airtouch` is fast.
"""

import numbers
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from airtouch.errors import AirTouchError, in_python, python_words
from airtouch.logs.flight_log import COLUMNS, FlightLog

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

    from airtouch.detector.registry import Detector
    from airtouch.detector.trace import Trace
    from airtouch.gap.measurement import Measurement
    from airtouch.gap.result import Diagnosis
    from airtouch.simulation.scenario import Scenario
    from airtouch.twin.adapt import Adapted, Progress
    from airtouch.twin.fitting.calibrate import Bars
    from airtouch.vehicle import Vehicle

    Flight: TypeAlias = str | Path | FlightLog | DataFrame

__all__ = ["adapt", "detect", "diagnose", "evaluate", "from_pandas", "measure", "plots", "read", "simulate",
           "to_pandas", "write"]


@in_python
def read(flight: "Flight") -> FlightLog:
    """The flight log in a file of any known format or in a pandas table; a `FlightLog` is returned as it is.

    Raises AirTouchError, with file, place and remedy, for a flight that cannot be read.
    """
    from airtouch import logs

    if isinstance(flight, FlightLog):
        return flight
    if isinstance(flight, (str, Path)):
        return logs.read(flight)
    if not hasattr(flight, "columns"):
        raise AirTouchError(f"a flight is a file name, a FlightLog or a pandas table, not {type(flight).__name__}")
    return from_pandas(flight)


@in_python
def write(flight: "Flight", path: str | Path, *, force: bool = False) -> None:
    """Write a flight as canonical CSV (`.csv`, `.csv.gz`) or Parquet (`.parquet`), by the ending of the name.

    Raises AirTouchError for another ending and for a file that exists, without `force`.
    """
    from airtouch import logs

    logs.write(read(flight), Path(path), force=force)


@in_python
def to_pandas(flight: "Flight") -> "DataFrame":
    """The log's columns as a pandas table, one row for each sample, with the metadata in `attrs`.

    Raises AirTouchError without the extra 'pandas'.
    """
    pandas = _pandas()
    log = read(flight)
    table = pandas.DataFrame(dict(log.columns))
    table.attrs.update(log.meta)
    return table


def from_pandas(table: "DataFrame") -> FlightLog:
    """The flight log of a pandas table. Columns with other names than the log's are left out.

    So is a `sample_period_s` in `attrs` that `t_s` contradicts: the rows are a part of the log, or resampled.
    Raises AirTouchError if no column has a name of the log, and for one that holds something else than numbers.
    """
    from airtouch.logs.checks.readings import stated_period_fits

    names = [str(name) for name in table.columns if str(name) in COLUMNS]
    if not names:
        raise AirTouchError(f"no column of this table has a name of the flight log; it has "
                            f"{', '.join(map(str, table.columns))}")
    meta = {"source": "pandas table", "format": "pandas", **{str(k): v for k, v in table.attrs.items()}}
    columns = {}
    for name in names:
        try:
            columns[name] = table[name].to_numpy(dtype=float)
        except (TypeError, ValueError) as error:
            raise AirTouchError(f"column {name} of this table holds something else than numbers: {error}") from None
    if "t_s" in columns and not stated_period_fits(meta.get("sample_period_s"), columns["t_s"]):
        del meta["sample_period_s"]
    return FlightLog(columns, meta)


@in_python
def detect(flight: "Flight", detector: "str | Detector" = "best", model: str | Path | None = None) -> "Trace":
    """Detect the edges of a flight of n samples at 100 Hz.

    detector: best, paper, paper-stream, baseline, or an object with the interface `detector.registry.Detector`.
    model: file of a trained model, None for the shipped one. Returns a trace with `.edges` (sample, kind,
    probability) and `.probability`, (n,), of being over a platform. Warns of what a score would suffer from, as
    `evaluate` does in its remarks. Raises AirTouchError for a flight that lacks channels or has another rate.
    """
    from airtouch.detector import registry
    from airtouch.detector.evaluation import evaluate as scoring

    module, log = registry.get(detector), read(flight)
    trained = module.load(Path(model) if model else None)
    scoring.check(log, scoring.spare_of(module), scoring.arm_pwm_by(module, trained))
    for remark in scoring.remarks(log):
        warnings.warn(f"{log.source}: {remark}", stacklevel=_caller_level())
    return module.run(log, registry.model_for(module, trained, log))


@in_python
def evaluate(flights: "Flight | Iterable[Flight]", detector: "str | Detector" = "best", *,
             speed_mps: float | None = None, model: str | Path | None = None) -> dict[str, Any]:
    """Score a detector on flights; true edges come from their down range.

    flights: files, folders (by their manifest) or logs. speed_mps: commanded speed of flights without one in their
    manifest, instead of the log's. model: file of a trained model, None for the shipped one. Returns the content of
    `airtouch evaluate --json` (host/docs/scoring.md), with files that cannot be scored in `left_out`. Raises
    AirTouchError for a log that cannot be scored, and for one with edges and without a speed.
    """
    from airtouch.detector import registry
    from airtouch.detector.evaluation import evaluate as scoring
    from airtouch.detector.evaluation.data import dataset
    from airtouch.detector.evaluation.data.dataset import Condition, FlightFile
    from airtouch.detector.evaluation.score import FlightScore

    _check_speed(speed_mps)
    module, inputs = registry.get(detector), _several(flights)
    if not inputs:
        raise AirTouchError("no flight to score")
    trained = module.load(Path(model) if model else None)
    paths = [f for f in inputs if isinstance(f, (str, Path))]
    noted: list[tuple[FlightScore, list[str]]] = []

    def note(result: scoring.Result | AirTouchError) -> None:
        if isinstance(result, scoring.Result):
            noted.append((result.score, scoring.remarks(result.log)))

    scores, left_out = scoring.evaluate(dataset.collect(paths, speed_mps), module, trained, note) if paths else ([], [])
    for log in map(read, (f for f in inputs if not isinstance(f, (str, Path)))):
        file = dataset.with_flown_speed(FlightFile(Path(log.source), Condition(speed_mps=speed_mps)), log)
        scoring.check(log, scoring.spare_of(module), scoring.arm_pwm_by(module, trained))
        if scoring.truth(log) and file.condition.speed_mps is None:
            raise AirTouchError(f"{log.source}: speed unknown, so errors in metres are too: give speed_mps")
        result = scoring.evaluate_flight(file, log, module, trained)
        note(result)
        scores.append(result.score)
    name = detector if isinstance(detector, str) else getattr(detector, "__name__", type(detector).__name__)
    left_out = [(file, python_words(reason)) for file, reason in left_out]
    table = scoring.as_json(name, scores, left_out, module.lag_s(trained), module.parameters(trained))
    return table | {"remarks": scoring.remarks_by_flight(noted, scores, left_out)}


@in_python
def simulate(scenario: "str | Path | Scenario", flights: int = 1, *, vehicle: "Vehicle | str | Path | None" = None,
             effects: Mapping[str, Mapping[str, float]] | Sequence[tuple[str, Mapping[str, float]]] = (),
             without: Sequence[str] = (), seed: int = 0) -> list[FlightLog]:
    """Simulate flights of a scenario. A flight depends on these arguments and its number only.

    scenario: a scenario's or mission's name, a .toml file or an object; so is vehicle. effects: {name: {parameter:
    value}} to switch on; without: names to switch off. Raises AirTouchError for an unknown name, a wrong number and a
    flight that diverges.
    """
    from airtouch.simulation import batch
    from airtouch.simulation.flight import Diverged

    for name, value, least in (("flights", flights, 1), ("seed", seed, 0)):
        if not isinstance(value, numbers.Integral) or value < least:
            raise AirTouchError(f"{name} must be a whole number from {least}, not {value!r}")
    logs = list(batch.flights(scenario, flights, vehicle=vehicle, effects=effects, without=without, seed=seed))
    lost = [f for f in logs if isinstance(f, Diverged)]
    if lost:
        raise AirTouchError(f"{len(lost)} of {flights} flights diverged; the first: {lost[0]}")
    return [f for f in logs if isinstance(f, FlightLog)]


@in_python
def diagnose(flights: "Flight | Iterable[Flight]", vehicle: "Vehicle | str | Path | None" = None,
             baseline: "Flight | Iterable[Flight]" = (), *, without: Iterable[str] = (),
             report: str | Path | None = None, plots: bool = False, force: bool = False) -> "Diagnosis":
    """Find the unmodelled effect that the flights have in common, and the fraction of the gap that it explains.

    vehicle: a built-in name or .toml file; that of the logs if left out, and crazyflie-2.1-flow, with a warning,
    where the first names none or one of which no file is known. baseline: nominal flights. without: effects to exclude.
    report: HTML file to write. plots: whether `at.gap.plots` is to draw the result.
    The result's `plain()` is the JSON of `airtouch gap diagnose`.
    Raises AirTouchError for flights that cannot be used, for logs (the baseline's too) that name two vehicles where
    none is given, and for a report that exists, without `force`.
    """
    import airtouch.gap.diagnosis as module
    from airtouch.logs.files import check_free
    from airtouch.report import gap_report

    if report is not None:
        check_free(Path(report), force)
    logs, nominal = _logs(flights), _logs(baseline)
    diagnosis = module.diagnose(logs, _vehicle(vehicle, [*logs, *nominal]), nominal, without=without,
                                curves=plots or report is not None)
    if report is not None:
        gap_report.write_diagnosis(Path(report), diagnosis, command="airtouch.gap.diagnose(...)", force=force)
    return diagnosis


@in_python
def measure(flights: "Flight | Iterable[Flight]", vehicle: "Vehicle | str | Path | None" = None,
            baseline: "Flight | Iterable[Flight]" = (), *, plots: bool = False) -> "Measurement":
    """The map of the gap between flights and the vehicle's model, without a cause. Arguments as in `diagnose`."""
    import airtouch.gap.measurement as module

    logs, nominal = _logs(flights), _logs(baseline)
    craft = _vehicle(vehicle, [*logs, *nominal])
    measurement = module.measure(logs, craft, nominal)
    return replace(measurement, curves=module.curves_of_measurement(measurement, logs, craft)) if plots \
        else measurement


@in_python
def plots(result: "Diagnosis | Measurement") -> "dict[str, Figure]":
    """The plots of a report as matplotlib figures, of what `diagnose` or `measure` returned with `plots=True`.

    Keys: "signal", of the channel and band of the answer; "spectra", of the gap; "commands", spectra of the motor
    commands. One that there is nothing for is left out. Each is drawn anew at each call, without pyplot, so restyle it
    by its `axes` and save it by `savefig`, as PDF or SVG too. Raises AirTouchError for a result without curves, and
    without the extra 'plots'.
    """
    from airtouch.extras import need
    from airtouch.report import gap_report

    need("plots", "a plot")
    if result.curves is None:
        raise AirTouchError("this result has no curves to plot; call diagnose or measure with plots=True")
    return gap_report.figures(result.curves)


@in_python
def adapt(flights: "str | Path | Iterable[str | Path]", out: str | Path, *, twin: str | Path | None = None,
          vehicle: "Vehicle | str | Path | None" = None, speed_mps: float | None = None, seed: int = 0,
          hold_out: bool = True, force: bool = False, progress: "Progress | None" = None) -> "Adapted":
    """Train a detector for the drone of these flights, and write it to `out`. The same call continues after a stop.

    twin: a folder of `airtouch twin`; without, one is fitted to the flights, as `airtouch adapt` does. vehicle: what
    this fit starts from. speed_mps: commanded speed, if no manifest states it. hold_out: also measure the errors by
    cross-validation. progress: called as progress(stage, done, total, note), since this takes minutes. The result's
    `plain()` says what was done. Raises AirTouchError without the extra 'train', without a flight that crosses an edge,
    for a log or table in place of a file, for a twin and a vehicle together, and for an `out` that exists, without
    `force`.
    """
    from airtouch.detector import best
    from airtouch.detector.evaluation.data import dataset
    from airtouch.extras import need
    from airtouch.logs.files import check_free
    from airtouch.twin import adapt as module
    from airtouch.twin import adapt_report

    need("train", "training")
    _check_speed(speed_mps)
    out = Path(out)
    check_free(out, force)
    adapt_report.check_vehicle(twin, vehicle)
    files = _several(flights)
    if others := [type(f).__name__ for f in files if not isinstance(f, (str, Path))]:
        raise AirTouchError(f"flights to adapt to are files or folders, not {others[0]}; airtouch.write makes a file")
    start = best.load(None)
    usable, left_out, simulator, work = adapt_report.prepared(
        dataset.collect(files, speed_mps), out, None if twin is None else Path(twin), vehicle, speed_mps=speed_mps,
        seed=seed, bar=_stages(progress), start=start)
    adapted = module.adapt(usable, simulator.scenario, simulator.vehicle, work, start=start, seed=seed,
                           hold_out=hold_out, progress=progress, command="airtouch.adapt(...)")
    adapted.model.save(out, force)
    return replace(adapted, left_out=left_out)


def _stages(progress: "Progress | None") -> "Bars":
    """Stages of a fit as bars (`calibrate.Bars`), reported as progress(stage, done, total, note)."""
    @contextmanager
    def bar(stage: str) -> Iterator[Callable[[int, int, str], None]]:
        """One stage."""
        yield (lambda done, total, note: progress(stage, done, total, note)) if progress else (lambda *_: None)

    return bar


def _logs(flights: "Flight | Iterable[Flight]") -> list[FlightLog]:
    """The logs of flights; a folder stands for the logs in it.

    Raises AirTouchError for a flight that cannot be read and for a folder without one.
    """
    from airtouch.logs.files import flights_in
    from airtouch.logs.formats.rosbag import is_bag

    logs = []
    for flight in _several(flights):
        folder = Path(flight) if isinstance(flight, (str, Path)) else None
        if folder is None or not folder.is_dir() or is_bag(folder):
            logs.append(read(flight))
            continue
        logs += [read(f) for f in flights_in(folder)]
    return logs


def _several(flights: Any) -> list[Any]:
    """One flight or several as a list. Raises AirTouchError for what is neither."""
    if isinstance(flights, (str, Path, FlightLog)) or hasattr(flights, "columns"):
        return [flights]
    if not isinstance(flights, Iterable):
        raise AirTouchError("flights are file names, FlightLogs or pandas tables, one or a list of them, not "
                            f"{type(flights).__name__}")
    return list(flights)


def _check_speed(speed_mps: float | None) -> None:
    """Raise AirTouchError for a commanded speed that the command line refuses too; None is no speed."""
    from airtouch.detector.evaluation.data.dataset import MOST_MPS

    if speed_mps is not None and not (isinstance(speed_mps, numbers.Real) and 0 < speed_mps <= MOST_MPS):
        raise AirTouchError(f"speed_mps must be above 0 and at most {MOST_MPS:g} m/s, not {speed_mps!r}")


def _vehicle(named: Any, logs: Sequence[FlightLog]) -> "Vehicle":
    """The named vehicle, or that of the logs for None, with a warning where it was assumed."""
    from airtouch import vehicle as vehicles

    if named is None:
        craft, warning = vehicles.of_logs(logs)
        if warning:
            warnings.warn(python_words(warning), stacklevel=_caller_level())
        return craft
    return named if isinstance(named, vehicles.Vehicle) else vehicles.load(named)


def _caller_level() -> int:
    """The `stacklevel` of a warning, given in the function that calls this, for the first caller outside AirTouch."""
    level, frame = 1, sys._getframe(1)
    while frame.f_back is not None and frame.f_globals.get("__name__", "").split(".")[0] == "airtouch":
        level, frame = level + 1, frame.f_back
    return level


def _pandas() -> Any:
    """The module pandas. Raises AirTouchError where it is not installed."""
    try:
        import pandas
    except ImportError:
        raise AirTouchError("pandas is not installed: pip install pandas") from None
    return pandas
