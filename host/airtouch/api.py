"""What `import airtouch as at` offers: flights in, answers out, each in one call.

Flights are given as file names, `FlightLog`s or pandas tables with the log's column names. Everything heavy is
imported when it is first used, so `import airtouch` itself is quick.
"""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from airtouch.errors import AirTouchError
from airtouch.logs.flight_log import COLUMNS, FlightLog

if TYPE_CHECKING:
    from pandas import DataFrame

    from airtouch.detector.registry import Detector
    from airtouch.detector.trace import Trace
    from airtouch.gap.measure import Measurement
    from airtouch.gap.result import Diagnosis
    from airtouch.simulation.scenario import Scenario
    from airtouch.twin.adapt import Adapted
    from airtouch.vehicle import Vehicle

    Flight: TypeAlias = str | Path | FlightLog | DataFrame

__all__ = ["adapt", "detect", "diagnose", "evaluate", "from_pandas", "measure", "read", "simulate", "to_pandas",
           "write"]
DEFAULT_VEHICLE = "crazyflie-2.1-flow"


def read(flight: "Flight") -> FlightLog:
    """A flight log, from a file of any known format or from a pandas table; a `FlightLog` is returned as it is.

    Raises AirTouchError with file, place and remedy.
    """
    from airtouch import logs

    if isinstance(flight, FlightLog):
        return flight
    return logs.read(flight) if isinstance(flight, (str, Path)) else from_pandas(flight)


def write(flight: "Flight", path: str | Path, *, force: bool = False) -> None:
    """Write a flight as the project's own CSV, gzipped or not, or Parquet, by the file's ending."""
    from airtouch import logs

    logs.write(read(flight), Path(path), force=force)


def to_pandas(flight: "Flight") -> "DataFrame":
    """The log's columns as a pandas table, one row a sample; what is known of the flight is in `attrs`."""
    pandas = _pandas()
    log = read(flight)
    table = pandas.DataFrame(dict(log.columns))
    table.attrs.update(log.meta)
    return table


def from_pandas(table: "DataFrame") -> FlightLog:
    """A flight log from a pandas table whose columns have the log's names; other columns are left out.

    Raises AirTouchError where none has.
    """
    names = [str(name) for name in table.columns if str(name) in COLUMNS]
    if not names:
        raise AirTouchError(f"no column of this table has a name of the flight log; it has "
                            f"{', '.join(map(str, table.columns))}")
    meta = {"source": "pandas table", "format": "pandas", **{str(k): v for k, v in table.attrs.items()}}
    return FlightLog({name: table[name].to_numpy(dtype=float) for name in names}, meta)


def detect(flight: "Flight", detector: "str | Detector" = "best", model: str | Path | None = None) -> "Trace":
    """Edges felt in a flight: `.edges` (sample, kind, probability) and `.probability` (n,) of being over a platform.

    detector: best, paper, paper-stream, baseline or an object like those of `detector.registry.Detector`; model: a
    trained file, the shipped one for None.
    """
    from airtouch.detector import registry
    from airtouch.detector.evaluation import evaluate as scoring

    chosen, log = registry.get(detector), read(flight)
    scoring.check(log, scoring.spare_of(chosen))
    trained = chosen.load(Path(model) if model else None)
    return chosen.run(log, chosen.model_for(trained, log) if hasattr(chosen, "model_for") else trained)


def evaluate(flights: "Flight | Iterable[Flight]", detector: "str | Detector" = "best", *,
             speed_mps: float | None = None, model: str | Path | None = None) -> dict[str, Any]:
    """Score a detector on flights with known edges: the content of `airtouch evaluate --json`.

    flights: files, folders (by their manifest) or logs; speed_mps: commanded speed where no manifest and no log says
    it.
    """
    from airtouch.detector import registry
    from airtouch.detector.evaluation import dataset
    from airtouch.detector.evaluation import evaluate as scoring
    from airtouch.detector.evaluation.dataset import Condition, FlightFile

    chosen, inputs = registry.get(detector), _several(flights)
    trained = chosen.load(Path(model) if model else None)
    paths = [f for f in inputs if isinstance(f, (str, Path))]
    scores, left_out = scoring.evaluate(dataset.collect(paths, speed_mps), chosen, trained) if paths else ([], [])
    for log in map(read, (f for f in inputs if not isinstance(f, (str, Path)))):
        speed = speed_mps or _flown_speed(log)
        scoring.check(log, scoring.spare_of(chosen))
        if scoring.truth(log) and speed is None:
            raise AirTouchError(f"{log.source}: speed unknown, so errors in metres are too: give speed_mps")
        file = FlightFile(Path(log.source), Condition(speed_mps=speed))
        scores.append(scoring.evaluate_flight(file, log, chosen, trained).score)
    name = detector if isinstance(detector, str) else getattr(detector, "__name__", type(detector).__name__)
    return scoring.as_json(name, scores, left_out, chosen.lag_s(trained), chosen.parameters(trained))


def simulate(scenario: "str | Path | Scenario", flights: int = 1, *, vehicle: "Vehicle | str | Path | None" = None,
             effects: Mapping[str, Mapping[str, float]] | Sequence[tuple[str, Mapping[str, float]]] = (),
             without: Sequence[str] = (), seed: int = 0) -> list[FlightLog]:
    """Fly a scenario and return the logs; effects: {name: {parameter: value}} to switch on. Raises AirTouchError.

    A flight depends on these arguments and its number alone.
    """
    from airtouch.simulation import batch
    from airtouch.simulation.flight import Diverged

    chosen = list(effects.items()) if isinstance(effects, Mapping) else list(effects)
    flown = list(batch.flights(scenario, flights, vehicle=vehicle, effects=chosen, without=without, seed=seed))
    lost = [f for f in flown if isinstance(f, Diverged)]
    if lost:
        raise AirTouchError(f"{len(lost)} of {flights} flights diverged; the first: {lost[0]}")
    return [f for f in flown if isinstance(f, FlightLog)]


def diagnose(flights: "Flight | Iterable[Flight]", vehicle: "Vehicle | str | Path | None" = None,
             baseline: "Flight | Iterable[Flight]" = (), *, without: Iterable[str] = (),
             report: str | Path | None = None, force: bool = False) -> "Diagnosis":
    """Name the unmodelled effect that the flights have in common, and how much of the gap it is.

    vehicle: a built-in name or .toml file; the one that the first log names where left out. baseline: flights without
    any unmodelled effect. report: HTML file to write. The result's `plain()` is the JSON of `airtouch gap diagnose`.
    """
    from airtouch.gap import diagnose as module
    from airtouch.report import gap_report

    logs = [read(f) for f in _several(flights)]
    diagnosis = module.diagnose(logs, _vehicle(vehicle, logs), [read(f) for f in _several(baseline)], without=without,
                                pictures=report is not None)
    if report is not None:
        gap_report.write_diagnosis(Path(report), diagnosis, command="airtouch.gap.diagnose(...)", force=force)
    return diagnosis


def measure(flights: "Flight | Iterable[Flight]", vehicle: "Vehicle | str | Path | None" = None,
            baseline: "Flight | Iterable[Flight]" = ()) -> "Measurement":
    """Map where flights and the vehicle's model part, before anything is blamed for it. Arguments as `diagnose`."""
    from airtouch.gap import measure as module

    logs = [read(f) for f in _several(flights)]
    return module.measure(logs, _vehicle(vehicle, logs), [read(f) for f in _several(baseline)])


def adapt(flights: "str | Path | Iterable[str | Path]", out: str | Path, *, twin: str | Path | None = None,
          speed_mps: float | None = None, seed: int = 0, hold_out: bool = True, force: bool = False) -> "Adapted":
    """Train a detector for the drone that flew some flights and write it to `out`; the same call goes on after a stop.

    twin: a folder of `airtouch twin`, the simulator as it is for None. Needs the extra 'train'.
    """
    from airtouch import vehicle as vehicles
    from airtouch.detector import best
    from airtouch.detector.evaluation import dataset
    from airtouch.extras import need
    from airtouch.logs.files import check_free
    from airtouch.simulation import scenario
    from airtouch.twin import adapt as module
    from airtouch.twin import files

    need("train", "training")
    out = Path(out)
    check_free(out, force)
    usable, left_out = module.readable(dataset.collect(_several(flights), speed_mps))
    if not usable:
        raise AirTouchError(left_out[0][1] if left_out else "no flight that can be trained on")
    scene = scenario.load(Path(twin) / files.SCENARIO if twin else "paper-mixed")
    craft = vehicles.load(Path(twin) / files.VEHICLE if twin else DEFAULT_VEHICLE)
    adapted = module.adapt(usable, scene, craft, out.with_suffix(".adapt"), start=best.load(None), seed=seed,
                           hold_out=hold_out, command="airtouch.adapt(...)")
    adapted.model.save(out, force)
    return adapted


def _flown_speed(log: FlightLog) -> float | None:
    """Commanded speed that a log's metadata holds (of a converted or a simulated flight), m/s."""
    drawn = log.meta.get("condition")
    return log.meta.get("speed_mps") or (drawn.get("speed") if isinstance(drawn, Mapping) else None)


def _several(flights: Any) -> list[Any]:
    """One flight or many as a list."""
    one = isinstance(flights, (str, Path, FlightLog)) or hasattr(flights, "columns")
    return [flights] if one else list(flights)


def _vehicle(named: Any, logs: Sequence[FlightLog]) -> "Vehicle":
    from airtouch import vehicle as vehicles

    if named is None:
        logged = str(logs[0].meta.get("vehicle") or "") if logs else ""
        try:
            return vehicles.load(logged or DEFAULT_VEHICLE)
        except AirTouchError:
            return vehicles.load(DEFAULT_VEHICLE)
    return vehicles.load(named) if isinstance(named, (str, Path)) else named


def _pandas() -> Any:
    try:
        import pandas
    except ImportError:
        raise AirTouchError("pandas is not installed: pip install pandas") from None
    return pandas
