"""Training of `best`: from flight logs to a model."""

import hashlib
import os
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from airtouch import __version__, logs
from airtouch.detector.best import detector
from airtouch.detector.best.batches import TrainingFlight, edges_of, flight_of
from airtouch.detector.best.fit_settings import Examples, FitSettings, Labelled, Progress
from airtouch.detector.best.model import BestModel
from airtouch.detector.best.recipe import Recipe
from airtouch.detector.evaluation import evaluate, tuning
from airtouch.detector.shared import training_set
from airtouch.errors import AirTouchError
from airtouch.logs.files import make_folder
from airtouch.logs.flight_log import FlightLog
from airtouch.parameters import SAMPLE_PERIOD_S
from airtouch.reference.edge_decoder import DecoderConfig


def fit(flights: Sequence[FlightLog], seed: int = 0, settings: FitSettings | None = None, **changes: Any) -> BestModel:
    """A model trained on the flights, pruned and quantised. The same arguments give the same bits on one machine.

    flights: 100 Hz logs, labelled by their own down range or by `settings.pseudo_labels`; a sensor that none of them
    has is silent in the model for good.
    seed: of the first weights, the crops and the draw of `settings.most_flights`.
    settings: `FitSettings()` for None. changes: fields of it, or of its recipe, by name: `fit(flights, steps=300)`.
    The model's lag is the median over the training flights, or over `settings.lag_of`; its metadata hold the flights'
    names and hashes, and the hashes of `settings.free_air`.
    Raises AirTouchError without TensorFlow, without flights with edges, for unknown changes, for a network that the
    C kernels do not take, and for a recipe of another shape than that of `settings.start`.
    """
    from airtouch.detector.best import quantisation, training
    from airtouch.detector.shared.tensorflow import use_tensorflow

    settings, recipe = (settings or FitSettings()).resolved(changes)
    examples, start = Examples.drawn(flights, settings, seed), settings.start
    recipe = examples.muted(recipe)
    quantisation.check_runs_in_c(recipe)
    report = settings.progress or (lambda *_: None)
    use_tensorflow(seed)
    training_flights = _training_flights(examples, recipe, report)
    weights = training.fit(training_flights, recipe, seed, lambda done, total, note: report("steps", done, total, note),
                           free_air=[flight_of(log, recipe, ()) for log in settings.free_air],
                           start=start.weights if start else None,
                           resume=_resume_file(examples, recipe, settings, seed))
    int8, tflite = quantisation.quantise_network(weights, recipe,
                                                 quantisation.windows([f.x for f in training_flights], recipe))
    model = BestModel(recipe, weights, int8, tflite, {
        "detector": "best", "version": __version__, "command": settings.command, "seed": seed, "lag_s": 0.0,
        "sigma_s": detector.TIMING_SIGMA_S, **_decoders(settings.decoder, start),
        **training_set.of(examples.flights, start, settings.free_air)})
    return with_lag(model, *([settings.lag_of] if settings.lag_of else []), (examples.flights, examples.labels))


def with_lag(model: BestModel, *groups: Labelled) -> BestModel:
    """The model with its lag on the first group of flights in which it detects an edge; its own lag without any.

    A group: logs, and the edges of each, None where its down range shows them.
    """
    for flights, labels in groups:
        pairs = [(edges_of(log, model.recipe) if edges is None else edges, detector.run(log, model).edges)
                 for log, edges in zip(flights, labels, strict=True)]
        lag = tuning.lag(pairs, np.nan)
        if np.isfinite(lag):
            return replace(model, metadata={**model.metadata, "lag_s": lag})
    return model


def pseudo_labels(flights: Sequence[FlightLog], model: BestModel) -> list[list[logs.Edge] | None]:
    """For `fit`: None for a flight whose down range labels it, else the edges that the model detects, less its lag.

    Their heights are NaN, for they are not known.
    """
    return [None if evaluate.truth(log) is not None else _detected(log, detector.model_for(model, log))
            for log in flights]


def _detected(log: FlightLog, model: BestModel) -> list[logs.Edge]:
    """The edges that the model which serves the log detects, less that model's lag."""
    lag = round(detector.lag_s(model) / SAMPLE_PERIOD_S)
    return [logs.Edge(max(edge.sample - lag, 0), edge.kind, np.nan, np.nan) for edge in detector.run(log, model).edges]


def _training_flights(examples: Examples, recipe: Recipe, report: Progress) -> list[TrainingFlight]:
    """The flights as the trainer takes them; AirTouchError where none has an edge."""
    flights = []
    for i, (log, edges) in enumerate(zip(examples.flights, examples.labels, strict=True)):
        flights.append(flight_of(log, recipe, edges))
        report("features", i + 1, len(examples.flights), os.path.basename(log.source))
    if examples.emphasis is not None:
        flights = [replace(f, weight=f.weight * share) for f, share in zip(flights, examples.emphasis, strict=True)]
    if not sum(len(f.edges) for f in flights):
        raise AirTouchError("training: the flights hold no edges; give flights over a platform, with down range")
    return flights


def _resume_file(examples: Examples, recipe: Recipe, settings: FitSettings, seed: int) -> Path | None:
    """The file that keeps the state of a training with these arguments; None without a folder."""
    if settings.work is None:
        return None
    make_folder(settings.work)
    hashes = [training_set.flight_hash(log) for log in (*examples.flights, *settings.free_air)]
    parts = [__version__, repr(recipe), str(seed), repr([examples.labels, examples.emphasis]), *hashes]
    start = settings.start.weights.values() if settings.start else ()
    weights = b"".join(np.ascontiguousarray(values).tobytes() for values in start)
    return settings.work / f"training_{hashlib.sha256('|'.join(parts).encode() + weights).hexdigest()[:16]}.npz"


def _decoders(decoder: DecoderConfig | None, start: BestModel | None) -> dict[str, Any]:
    """Metadata: the decoder's settings with all sensors and without one; a `decoder` serves for all."""
    if decoder is not None:
        return {"decoder": asdict(decoder), "decoder_without": {}}
    if start is not None:
        return {name: start.metadata[name] for name in ("decoder", "decoder_without") if name in start.metadata}
    return {"decoder": asdict(detector.DECODER),
            "decoder_without": {name: asdict(config) for name, config in detector.DECODER_WITHOUT.items()}}
