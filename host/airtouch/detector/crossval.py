"""Cross-validation by flight: every flight is scored by a model that never saw it."""

import hashlib
import json
import os
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from airtouch import __version__
from airtouch.detector import evaluate
from airtouch.detector.dataset import FlightFile
from airtouch.detector.registry import Detector, get
from airtouch.detector.score import FlightScore
from airtouch.errors import AirTouchError
from airtouch.logs.files import write_bytes
from airtouch.logs.flight_log import FlightLog

Tell = Callable[[str], None]


def folds_of(files: Sequence[FlightFile]) -> dict[int, list[FlightFile]]:
    """Fold -> its flights. Raises AirTouchError for flights without a fold or with fewer than two folds."""
    folds: dict[int, list[FlightFile]] = {}
    for file in files:
        if file.condition.fold is None:
            raise AirTouchError(f"{file.path}: no fold in the manifest beside it; "
                                "add a column 'fold' (0, 1, ...)")
        folds.setdefault(file.condition.fold, []).append(file)
    if len(folds) < 2:
        raise AirTouchError("cross-validation needs at least two folds; the manifest's column 'fold' has "
                            f"{len(folds)}")
    return dict(sorted(folds.items()))


def crossval(
    name: str,
    files: Sequence[FlightFile],
    out: Path,
    *,
    seed: int = 0,
    options: dict[str, Any] | None = None,
    physical_filter: bool = True,
    detector: Detector | None = None,
    tell: Tell = lambda _: None,
) -> tuple[list[FlightScore], list[dict[str, Any]], list[tuple[str, str]]]:
    """(scores of all flights, one entry a fold, flights left out).

    Finished folds are kept in `out` and not done again for the same flights, settings and version.
    options go to the detector's `fit`. physical_filter False chooses the decoding again without it.
    detector: one that is not registered, under the name given.
    """
    detector = detector or get(name)
    if not physical_filter and not hasattr(detector, "retune"):
        raise AirTouchError(f"{name} has no physical filter to switch off")
    folds = folds_of(files)
    out.mkdir(parents=True, exist_ok=True)
    readable, left_out = readable_flights(files)
    scores: list[FlightScore] = []
    entries: list[dict[str, Any]] = []
    for fold, members in folds.items():
        test = [f for f in members if f.path in readable]
        train = [readable[f.path] for f in files if f.path in readable and f.condition.fold != fold]
        key = cache_key(name, files, fold, seed, options or {})
        cache = out / f"{name}{'' if physical_filter else '-unfiltered'}_fold{fold}_{key}.json"
        entry = cached(cache)
        if entry is None:
            tell(f"fold {fold}: training on {len(train)} flights, {len(test)} held out")
            started = time.monotonic()
            kept = out / f"{name}_fold{fold}_{key}.npz"
            model = model_of_fold(detector, train, kept, seed, options or {})
            if not physical_filter:
                model = detector.retune(model, train, False)
            results = [evaluate.evaluate_flight(f, readable[f.path], detector, model).score for f in test]
            entry = {"fold": fold, "model": kept.name, "lag_s": detector.lag_s(model), "parameters": detector.parameters(model),
                     "seconds": round(time.monotonic() - started, 1),
                     "per_flight": [s.as_dict() for s in results]}
            write_bytes(json.dumps(entry, allow_nan=False).encode(), cache, force=True)
        else:
            tell(f"fold {fold}: done before, {cache.name}")
        scores += [FlightScore.from_dict(s) for s in entry["per_flight"]]
        entries.append({k: v for k, v in entry.items() if k != "per_flight"})
    return scores, entries, left_out


def readable_flights(files: Sequence[FlightFile]) -> tuple[dict[Path, FlightLog], list[tuple[str, str]]]:
    """Logs by path, and those that cannot be used with the reason."""
    logs: dict[Path, FlightLog] = {}
    left_out = []
    for file in files:
        try:
            log = evaluate.read_flight(file)
            if evaluate.truth(log) is None:
                raise AirTouchError(f"{file.path}: no down range in this log, so no true edges to train on")
            logs[file.path] = log
        except AirTouchError as error:
            left_out.append((str(file.path), str(error)))
    return logs, left_out


def model_of_fold(detector: Detector, flights: Sequence[FlightLog], path: Path, seed: int,
                  options: dict[str, Any]) -> Any:
    """The fold's model from `path`, else trained now and kept there, where it can be saved."""
    if path.exists():
        return detector.load(path)
    model = detector.fit(flights, seed=seed, **options)
    if hasattr(model, "save"):
        model.save(path, force=True)
    return model


def random_windows(files: Sequence[FlightFile], *, seed: int = 0, epochs: int = 10,
                   share: float = 0.2) -> dict[str, float | int]:
    """The paper's split, which leaks: windows of all flights dealt at random into training and test.

    Neighbouring windows share 99 of 100 samples, so the test set was as good as seen. Returns
    balanced_accuracy of the float network on the test windows, windows tested, epochs.
    """
    from airtouch.detector import network, pruning, train
    from airtouch.detector.losses import DEFAULT_LAMBDA
    from airtouch.kernels.network import infer_float

    train.use_tensorflow(seed)
    logs, _ = readable_flights(files)
    windows = train.training_windows(list(logs.values()), lambda *_: None)
    test = np.random.default_rng(seed).uniform(size=len(windows.x)) < share
    nothing = windows.select(np.zeros(len(test), bool))  # to stop early on: the paper trains to the end
    weights, _ = train.fit_windows(windows.select(~test), nothing, epochs, 0.0, pruning.BLOCK, DEFAULT_LAMBDA,
                                   lambda *_: None)
    logits = infer_float(network.float_layers(weights), windows.x[test])
    said, over = logits[:, 1] > logits[:, 0], windows.over[test] > 0.5
    return {"balanced_accuracy": float(0.5 * (said[over].mean() + (~said[~over]).mean())),
            "windows": int(test.sum()), "epochs": epochs}


def cache_key(name: str, files: Sequence[FlightFile], fold: int, seed: int, options: dict[str, Any]) -> str:
    """Twelve hexadecimal digits that change with anything a fold's result depends on."""
    total = hashlib.sha256(f"{__version__} {name} {fold} {seed} {sorted(options.items())}".encode())
    for file in files:
        stat = os.stat(file.path) if file.path.exists() else None
        content = stat and (stat.st_size, stat.st_mtime_ns)
        total.update(f"{file.path.name} {file.condition} {content}".encode())
    return total.hexdigest()[:12]


def cached(path: Path) -> dict[str, Any] | None:
    """A finished fold, or None where there is none or it is damaged."""
    try:
        entry = json.loads(path.read_text())
        for score in entry["per_flight"]:
            FlightScore.from_dict(score)
        return entry
    except (OSError, ValueError, KeyError, TypeError):
        return None
