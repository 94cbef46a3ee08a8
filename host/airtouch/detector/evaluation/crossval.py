"""Cross-validation by flight: every flight is scored by a model that never saw it."""

import hashlib
import json
import os
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from airtouch import __version__
from airtouch.detector.evaluation import evaluate
from airtouch.detector.evaluation.data.dataset import FlightFile
from airtouch.detector.evaluation.data.folds import Folds, by_fold
from airtouch.detector.evaluation.score import FlightScore
from airtouch.detector.registry import Detector, Filtered, get
from airtouch.detector.shared import sensors, training_set
from airtouch.errors import AirTouchError
from airtouch.logs.files import make_folder, write_bytes
from airtouch.logs.flight_log import FlightLog

Tell = Callable[[str], None]


@dataclass(frozen=True)
class Settings:
    """What is trained and scored in every fold; the defaults are a detector as it is, on flights as they are.

    seed: of every training. options: arguments of the detector's `fit`, by name. free_air: flights without edges to
    train on too. silent_training: train without the sensors of `silenced` too.
    Of the scoring alone: physical_filter: False chooses the decoding again without the filter. silenced: sensors
    (`sensors.SENSORS`) that are taken from the flights that are scored.
    """

    seed: int = 0
    options: Mapping[str, Any] = field(default_factory=dict)
    free_air: Sequence[FlightLog] = ()
    physical_filter: bool = True
    silenced: tuple[str, ...] = ()
    silent_training: bool = False

    def fit_options(self) -> dict[str, Any]:
        """Arguments of the detector's `fit`."""
        return {**self.options, **({"free_air": self.free_air} if self.free_air else {})}

    def hashed(self) -> dict[str, Any]:
        """What the name of a fold's model depends on, beside flights and seed."""
        options = dict(self.options)
        if self.free_air:
            options["free_air"] = [training_set.flight_hash(log) for log in self.free_air]
        if self.silent_training:
            options["silent"] = self.silenced
        return options

    def variant(self) -> str:
        """Part of the name of a fold's scores: what is done to a trained model or to the flights that it scores."""
        return "".join(("" if self.physical_filter else "-unfiltered", *(f"-no-{s}" for s in self.silenced)))


@dataclass(frozen=True)
class Fold:
    """One fold: its model's file in the folder of results, that model's lag and parameters, and what the fold took.

    fold: its name, as in the manifest. seconds, cpu_seconds: of training, if it was not done before, and scoring;
    cpu_seconds is None in results of an older version.
    """

    fold: int | str
    model: str
    lag_s: float
    parameters: dict[str, Any]
    seconds: float
    cpu_seconds: float | None = None

    def plain(self) -> dict[str, Any]:
        """JSON-ready, without what is not known."""
        return {k: v for k, v in asdict(self).items() if v is not None}


@dataclass(frozen=True)
class CrossValidation:
    """Scores of all flights, the folds, and (file, reason) of flights that were left out."""

    scores: list[FlightScore]
    folds: list[Fold]
    left_out: list[tuple[str, str]]


def crossval(name: str, files: Sequence[FlightFile], out: Path, settings: Settings | None = None, *,
             folds: Folds | None = None, detector: Detector | None = None, tell: Tell = lambda _: None,
             ) -> CrossValidation:
    """The scores of a detector's folds, each by a model of the other flights.

    Finished folds are kept in `out` and not done again for the same flights, settings and version.
    settings: `Settings()` for None. folds: which flights are held out together (`data.folds`); those of the manifest
    for None. detector: one that is not registered, under `name`. tell: called with a line a fold.
    Raises AirTouchError for an unknown detector, for a filter that it does not have, and for fewer than two folds.
    """
    own = "" if detector is None else repr(detector)
    detector, settings = detector or get(name), settings or Settings()
    if not settings.physical_filter and not isinstance(detector, Filtered):
        raise AirTouchError(f"{name} has no physical filter to switch off")
    folds = by_fold(files) if folds is None else folds
    make_folder(out)
    readable, left_out = readable_flights(files, evaluate.spare_of(detector), arm_pwm=evaluate.arm_pwm_by(detector))
    scores: list[FlightScore] = []
    done: list[Fold] = []
    for fold, members in folds.items():
        key = cache_key(name, files, members, settings.seed, settings.hashed(), own)
        cache = out / f"{name}{settings.variant()}_fold{fold}_{key}.json"
        entry = read_fold(cache)
        if entry is None:
            test_paths = {f.path for f in members}
            train = [readable[f.path] for f in files if f.path in readable and f.path not in test_paths]
            test = [(f, readable[f.path]) for f in members if f.path in readable]
            tell(f"fold {fold}: training on {len(train)} flights, {len(test)} held out")
            model = out / f"{name}_fold{fold}_{key}.npz"
            entry = {"fold": fold, **_score_fold(settings, detector, train, test, model)}
            write_bytes(json.dumps(entry, allow_nan=False).encode(), cache, force=True)
        else:
            tell(f"fold {fold}: done before, {cache.name}")
        scores += [FlightScore.from_dict(s) for s in entry["per_flight"]]
        done.append(Fold(**{k: v for k, v in entry.items() if k != "per_flight"}))
    return CrossValidation(scores, done, left_out)


def _score_fold(settings: Settings, detector: Detector, train: Sequence[FlightLog],
                test: Sequence[tuple[FlightFile, FlightLog]], path: Path) -> dict[str, Any]:
    """A fold's entry: the model of the training flights, kept in `path`, its settings, and its scores of the test."""
    started, cpu_before = time.monotonic(), time.process_time()
    silent = settings.silenced if settings.silent_training else ()
    train = [sensors.without(log, silent) for log in train]
    model = model_of_fold(detector, train, path, settings.seed, settings.fit_options())
    if not settings.physical_filter and isinstance(detector, Filtered):
        model = detector.retune(model, train, False)
    results = [evaluate.evaluate_flight(f, sensors.without(log, settings.silenced), detector, model).score
               for f, log in test]
    return {"model": path.name, "lag_s": detector.lag_s(model), "parameters": detector.parameters(model),
            "seconds": round(time.monotonic() - started, 1),
            "cpu_seconds": round(time.process_time() - cpu_before, 1), "per_flight": [s.as_dict() for s in results]}


def readable_flights(files: Sequence[FlightFile], spare: int = 0, scored: bool = True, arm_pwm: float | None = None,
                     ) -> tuple[dict[Path, FlightLog], list[tuple[str, str]]]:
    """(usable logs by path, the other files each with the reason). Up to `spare` sensors may be missing.

    scored: whether the logs are to be scored in metres too, so that their speed must be known. arm_pwm: as in
    `evaluate.check`.
    """
    logs: dict[Path, FlightLog] = {}
    left_out = []
    for file in files:
        try:
            log = (evaluate.read_flight if scored else evaluate.read_usable)(file, spare, arm_pwm)
            if evaluate.truth(log) is None:
                raise AirTouchError(f"{file.path}: no down range in this log, so no true edges to train on")
            logs[file.path] = log
        except AirTouchError as error:
            left_out.append((str(file.path), str(error)))
    return logs, left_out


def all_readable(files: Sequence[FlightFile], spare: int = 0) -> dict[Path, FlightLog]:
    """The logs by path. Raises AirTouchError, with the first reason, where one cannot be used (`readable_flights`)."""
    logs, left_out = readable_flights(files, spare)
    if left_out:
        raise AirTouchError(f"{left_out[0][1]} ({len(left_out)} of {len(files)} flights cannot be used: take them out)")
    return logs


def model_of_fold(detector: Detector, flights: Sequence[FlightLog], path: Path, seed: int,
                  options: dict[str, Any]) -> Any:
    """The fold's model, from `path` if that exists; else trained now, and saved there if such a model has a file."""
    if path.exists():
        return detector.load(path)
    model = detector.fit(flights, seed=seed, **options)
    if hasattr(model, "save"):
        model.save(path, force=True)
    return model


def cache_key(name: str, files: Sequence[FlightFile], test: Sequence[FlightFile], seed: int,
              options: dict[str, Any], own: str = "") -> str:
    """Twelve hexadecimal digits that change with version, detector, seed, options and the flights' files.

    own: the settings, as text, of a detector that is not registered.

    What the code sets by default is not among them: after a change of a recipe delete the folds that were kept.
    """
    total = hashlib.sha256(f"{__version__} {name} {seed} {sorted(options.items())}{own}".encode())
    for file in files:
        stat = os.stat(file.path) if file.path.exists() else None
        content = stat and (stat.st_size, stat.st_mtime_ns)
        total.update(f"{file.path.name} {file.condition} {content} {file in test}".encode())
    return total.hexdigest()[:12]


def read_fold(path: Path) -> dict[str, Any] | None:
    """A finished fold as JSON: the fields of `Fold`, and `per_flight`; None where there is none or it is damaged."""
    try:
        entry = json.loads(path.read_text())
        for score in entry["per_flight"]:
            FlightScore.from_dict(score)
        Fold(**{k: v for k, v in entry.items() if k != "per_flight"})
        return entry
    except (OSError, ValueError, KeyError, TypeError):
        return None
