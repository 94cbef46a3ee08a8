"""The `best` detector: a small causal network that runs on a stream of motion channels.

One step a sample in C (`firmware/kernels/stream_detector.h`): motion channels, int8 network
(`gap8/kernels/stream_int8.h`), decoder. Nothing waits for a window to fill.
"""

import hashlib
import os
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from airtouch import __version__, kernels, logs
from airtouch.detector.best import model as model_file
from airtouch.detector.best import sensor_note
from airtouch.detector.best.batches import TrainingFlight, channels_of, flight_of
from airtouch.detector.best.model import BestModel
from airtouch.detector.best.network import float_logits
from airtouch.detector.best.recipe import STRIDE, Recipe
from airtouch.detector.evaluation import evaluate, tuning
from airtouch.detector.shared import sensors, training_set
from airtouch.detector.shared.channels import nine_channels
from airtouch.detector.trace import Detection, Trace
from airtouch.errors import AirTouchError
from airtouch.kernels.network import parameter_bytes
from airtouch.kernels.stream import arena_bytes
from airtouch.kernels.stream_detector import StreamEvents
from airtouch.logs.files import make_folder
from airtouch.logs.flight_log import FlightLog
from airtouch.parameters import SAMPLE_PERIOD_S, SAMPLE_RATE_HZ
from airtouch.reference.edge_decoder import LOGITS, DecoderConfig

#: Chosen once over the five folds, by tools/choose_decoder.py with models of three seeds (host/docs/looks.md).
DECODER = DecoderConfig(over_share=0.3, entry_score=2.3, exit_score=1.1, late_entry=3.0, late_exit=-4.0,
                        smooth_gain=0.12, dwell_steps=20, arm_steps=100, look_back=50, hold_steps=20)
#: Decoder settings for a log that lacks a sensor, whose logits are less sure; chosen like DECODER, with `--silence`.
DECODER_WITHOUT = {
    "acceleration": DecoderConfig(over_share=0.5, entry_score=1.89, exit_score=3.78, late_entry=1.48, late_exit=-2.74,
                                  smooth_gain=0.08, dwell_steps=30, arm_steps=100, look_back=50, hold_steps=20),
    "rates": DecoderConfig(over_share=0.5, entry_score=2.72, exit_score=-0.11, late_entry=1.44, late_exit=-4.22,
                           smooth_gain=0.12, dwell_steps=20, arm_steps=100, look_back=50, hold_steps=20),
    "motors": DecoderConfig(over_share=0.3, entry_score=2.76, exit_score=2.55, late_entry=0.46, late_exit=-1.89,
                            smooth_gain=0.12, dwell_steps=20, arm_steps=100, look_back=50, hold_steps=20),
}
#: rms timing error of held-out flights with these settings, three seeds (printed by the same tool); for maps.
TIMING_SIGMA_S = 0.10
#: Changes to a model's recipe where training goes on from it.
FINE_TUNING: dict[str, Any] = {"steps": 300, "peak_rate": 1e-3}
SPARE_SENSORS = 1  #: of acceleration, rates and motors, one may be missing
KINDS = {1: "entry", 2: "exit"}

#: progress(stage, done, total, note), stage "features" (flights) or "steps"
Progress = Callable[[str, int, int, str], None]
#: Flights, and the edges of each, None where its down range shows them
Labelled = tuple[Sequence[FlightLog], Sequence[Sequence[logs.Edge] | None]]


def run(log: FlightLog, model: BestModel | None = None) -> Trace:
    """P(over a platform) and edges of one flight, by the sensors that the log has; None is the shipped model.

    Raises AirTouchError, naming columns, where more than one of acceleration, rates and motors is missing.
    """
    model = model_for(model, log)
    events = flight_events(log, model)
    return trace_of(log, model, events.logits, events.edge, events.airborne)


def model_for(model: BestModel | None, log: FlightLog) -> BestModel:
    """The model that serves this log: the shipped one has others for logs that lack a sensor."""
    return (model or load(None)).serving(sensors.missing_sensors(log))


def run_float(log: FlightLog, model: BestModel) -> Trace:
    """As `run`, with the float network as trained: what quantisation is measured against."""
    x, airborne = channels_of(log, model.recipe.motion)
    steps = float_logits(model.weights, model.recipe.graph, x)
    edge = np.zeros(len(log), dtype=np.uint8)
    edge[::STRIDE] = kernels.edge_decoder(steps[:, :len(LOGITS)], airborne[::STRIDE],
                                          model.decoder_without(sensors.missing_sensors(log)))
    return trace_of(log, model, np.repeat(steps, STRIDE, axis=0)[:len(log)], edge, airborne)


def trace_of(log: FlightLog, model: BestModel, logits: np.ndarray, edge: np.ndarray, airborne: np.ndarray) -> Trace:
    """Edges with the highest probability of their crossing that led to them."""
    over, *crossing = (1.0 / (1.0 + np.exp(-logits.astype(np.float64)))).T
    absent = sensors.missing_sensors(log)
    decoder = model.decoder_without(absent)
    recent = (decoder.hold_steps + decoder.look_back) * STRIDE
    edges = []
    for i in np.flatnonzero(edge):
        kind = int(edge[i])
        edges.append(Detection(int(i), KINDS[kind], float(crossing[kind - 1][max(i - recent, 0):i + 1].max())))
    signals = {"logits": logits} if absent else {"channels": nine_channels(log), "logits": logits}
    return Trace(np.where(airborne, over, 0.0), edges, signals, sensor_note.note(absent))


def flight_events(log: FlightLog, model: BestModel) -> StreamEvents:
    """One flight through the C detector."""
    logged = sensors.signals(log)
    return kernels.stream_detector(logged.acc, logged.gyro, logged.pwm, model.int8,
                                   sensors.silence(model.recipe.motion, logged.missing),
                                   model.decoder_without(logged.missing))


def fit(
    flights: Sequence[FlightLog], seed: int = 0, *, start: BestModel | None = None,
    pseudo_labels: Sequence[Sequence[logs.Edge] | None] | None = None, emphasis: Sequence[float] | None = None,
    free_air: Sequence[FlightLog] = (), recipe: Recipe | None = None, decoder: DecoderConfig | None = None,
    most_flights: int | None = None,
    progress: Progress | None = None, command: str = "airtouch.detector.best.fit", work: Path | None = None,
    lag_of: Labelled | None = None, **changes: Any
) -> BestModel:
    """Train, prune and quantise; the lag is the median over the training flights. Same arguments, same bits.

    flights: 100 Hz logs, labelled by their own down range. pseudo_labels: one entry a flight, its edges, or None where
    the down range labels it (`pseudo_labels` below makes them). emphasis: one entry a flight, how often it is drawn
    against the others; all alike where left out. start: a model to go on from: same network, its zeros stay,
    FINE_TUNING in place of a full training. free_air: flights without edges (`free_air.read`).
    recipe: shape and training, changed by `changes` (fields of `Recipe`: steps, peak_rate, ...). decoder: its settings;
    `start`'s, else DECODER. most_flights: train on so many at most, drawn by seed. A sensor that no flight has is
    silent for good. work: a folder in which the training is kept, so that the same call goes on after a stop.
    lag_of: flights, and edges as in pseudo_labels, whose lag counts before that of the training flights (`with_lag`).
    The flights' names and hashes go into the model's metadata.
    Raises AirTouchError without TensorFlow, without flights with edges and for unknown fields.
    """
    from airtouch.detector.best import quantisation, training
    from airtouch.detector.shared.tensorflow import use_tensorflow

    report = progress or (lambda *_: None)
    labels = list(pseudo_labels) if pseudo_labels is not None else [None] * len(flights)
    if len(labels) != len(flights):
        raise AirTouchError(f"training: {len(labels)} pseudo-labels for {len(flights)} flights; give one a flight")
    recipe = _recipe(recipe, changes, start)
    use_tensorflow(seed)
    if most_flights is not None and most_flights < len(flights):
        drawn = sorted(np.random.default_rng(seed).permutation(len(flights))[:most_flights])
        flights, labels = [flights[i] for i in drawn], [labels[i] for i in drawn]
        emphasis = emphasis if emphasis is None else [emphasis[i] for i in drawn]
    recipe = replace(recipe, muted=tuple(sorted({*recipe.muted, *sensors.silent_in_all(flights)})))
    examples = _examples(flights, labels, emphasis, recipe, report)
    weights = training.fit(examples, recipe, seed, lambda done, total, note: report("steps", done, total, note),
                           free_air=[flight_of(log, recipe, ()) for log in free_air],
                           start=start.weights if start else None,
                           resume=_resume_file(work, flights, free_air, [labels, emphasis], recipe, seed, start))
    int8, tflite = quantisation.quantise(weights, recipe, quantisation.windows([f.x for f in examples], recipe))
    model = BestModel(recipe, weights, int8, tflite, {
        "detector": "best", "version": __version__, "command": command, "seed": seed, "lag_s": 0.0,
        "sigma_s": TIMING_SIGMA_S, **_decoders(decoder, start), **training_set.of(flights, start),
        "free_air": len(free_air)})
    return with_lag(model, *([lag_of] if lag_of else []), (flights, labels))


def with_lag(model: BestModel, *groups: Labelled) -> BestModel:
    """The model with its lag on the first group of flights in which it finds an edge; its own lag where it finds none.

    A group: logs, and the edges of each, None where its down range shows them.
    """
    for flights, labels in groups:
        pairs = [(logs.true_edges(log) if edges is None else edges, run(log, model).edges)
                 for log, edges in zip(flights, labels, strict=True)]
        lag = tuning.lag(pairs, np.nan)
        if np.isfinite(lag):
            return replace(model, metadata={**model.metadata, "lag_s": lag})
    return model


def _examples(flights: Sequence[FlightLog], labels: Sequence[Sequence[logs.Edge] | None],
              emphasis: Sequence[float] | None, recipe: Recipe, report: Progress) -> list[TrainingFlight]:
    """The flights as the trainer takes them; AirTouchError where none has an edge."""
    examples = []
    for i, (log, edges) in enumerate(zip(flights, labels, strict=True)):
        examples.append(flight_of(log, recipe, edges))
        report("features", i + 1, len(flights), os.path.basename(log.source))
    if emphasis is not None:
        examples = [replace(f, weight=f.weight * share) for f, share in zip(examples, emphasis, strict=True)]
    if not sum(len(f.edges) for f in examples):
        raise AirTouchError("training: the flights hold no edges; give flights over a platform, with down range")
    return examples


def pseudo_labels(flights: Sequence[FlightLog], model: BestModel) -> list[list[logs.Edge] | None]:
    """For `fit`: None for a flight whose down range labels it, else the edges that the model detects, without its lag.

    Their heights are NaN, for they are not known.
    """
    lag = round(lag_s(model) / SAMPLE_PERIOD_S)
    return [None if evaluate.truth(log) is not None else
            [logs.Edge(max(edge.sample - lag, 0), edge.kind, np.nan, np.nan) for edge in run(log, model).edges]
            for log in flights]


def _resume_file(work: Path | None, flights: Sequence[FlightLog], free_air: Sequence[FlightLog], labels: Sequence[Any],
                 recipe: Recipe, seed: int, start: BestModel | None) -> Path | None:
    """The file that keeps the state of a training with these arguments; None without a folder."""
    if work is None:
        return None
    make_folder(work)
    parts = [repr(recipe), str(seed), repr(labels), *(training_set.flight_hash(f) for f in (*flights, *free_air))]
    weights = b"" if start is None else b"".join(np.ascontiguousarray(v).tobytes() for v in start.weights.values())
    return work / f"training_{hashlib.sha256('|'.join(parts).encode() + weights).hexdigest()[:16]}.npz"


def _decoders(decoder: DecoderConfig | None, start: BestModel | None) -> dict[str, Any]:
    """Metadata: the decoder's settings with all sensors and without one; one given serves for all."""
    if decoder is not None:
        return {"decoder": asdict(decoder), "decoder_without": {}}
    if start is not None:
        return {name: start.metadata[name] for name in ("decoder", "decoder_without") if name in start.metadata}
    return {"decoder": asdict(DECODER), "decoder_without": {name: asdict(c) for name, c in DECODER_WITHOUT.items()}}


def _recipe(recipe: Recipe | None, changes: dict[str, Any], start: BestModel | None) -> Recipe:
    """The recipe to train by: the given one, else that of FINE_TUNING of `start`, else the default; with the changes.

    Raises AirTouchError for an unknown field, and for another shape than that of `start`.
    """
    if recipe is None:
        recipe = replace(start.recipe, **FINE_TUNING) if start else Recipe()
    try:
        recipe = replace(recipe, **changes)
    except TypeError as error:
        raise AirTouchError(f"training: {str(error).split(') ')[-1]}; known: {', '.join(asdict(recipe))}") from None
    if start is not None and start.recipe.graph != recipe.graph:
        raise AirTouchError("training: the model to start from has another shape; leave width, taps and dilations "
                            "alone")
    return recipe


def load(path: Path | None) -> BestModel:
    """A model from its file, the shipped one for None; AirTouchError for any other file."""
    return model_file.load(path)


def lag_s(model: BestModel | None) -> float:
    """The lag learnt in training, seconds."""
    return float((model or load(None)).metadata["lag_s"])


def parameters(model: BestModel | None) -> dict[str, Any]:
    """Size, cost and settings, for reports."""
    model = model or load(None)
    return {"width": model.recipe.width, "receptive_s": model.recipe.receptive_samples / SAMPLE_RATE_HZ,
            "parameter_bytes": parameter_bytes(model.int8),
            "state_bytes": arena_bytes(model.int8),
            "mac_per_sample": model.int8.multiplications / STRIDE, **asdict(model.decoder),
            "seed": model.metadata.get("seed")}

