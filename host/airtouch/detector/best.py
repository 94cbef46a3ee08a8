"""The `best` detector: a small causal network over twelve motion channels, in streaming form.

One step a sample in C (`firmware/kernels/stream_detector.h`): motion channels, int8 network
(`gap8/kernels/stream_int8.h`), decoder. Nothing waits for a window to fill.
"""

import os
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from airtouch import __version__, kernels, logs
from airtouch.detector import tuning
from airtouch.detector.channels import level_acceleration, nine_channels
from airtouch.detector.stream import model as model_file
from airtouch.detector.stream.batches import channels_of
from airtouch.detector.stream.float_network import float_logits
from airtouch.detector.stream.model import StreamModel
from airtouch.detector.stream.recipe import STRIDE, Recipe
from airtouch.detector.trace import Detection, Trace
from airtouch.errors import AirTouchError
from airtouch.kernels.network import parameter_bytes
from airtouch.kernels.stream import arena_bytes
from airtouch.kernels.stream_detector import StreamEvents
from airtouch.logs.flight_log import GYRO, PWM, FlightLog
from airtouch.reference.edge_decoder import DecoderConfig

#: Chosen once over the five folds, by tools/choose_decoder.py with models of three seeds (host/docs/looks.md).
DECODER = DecoderConfig(over_share=0.3, entry_score=2.3, exit_score=1.1, late_entry=3.0, late_exit=-4.0,
                        smooth_gain=0.12, dwell_steps=20, arm_steps=100, look_back=50, hold_steps=20)
#: rms timing error of held-out flights with these settings, three seeds (printed by the same tool); for maps.
TIMING_SIGMA_S = 0.10
KINDS = {1: "entry", 2: "exit"}

#: progress(stage, done, total, note), stage "features" (flights) or "steps"
Progress = Callable[[str, int, int, str], None]


def run(log: FlightLog, model: StreamModel | None = None) -> Trace:
    """P(over a platform) and edges of one flight; AirTouchError that names missing columns."""
    model = model or load(None)
    events = flight_events(log, model)
    return trace_of(log, model, events.logits, events.edge, events.airborne)


def run_float(log: FlightLog, model: StreamModel) -> Trace:
    """As `run`, with the float network as trained: what quantisation is measured against."""
    x, airborne = channels_of(log, model.recipe.motion)
    steps = float_logits(model.weights, model.recipe, x)
    edge = np.zeros(len(log), dtype=np.uint8)
    edge[::STRIDE] = kernels.edge_decoder(steps, airborne[::STRIDE], model.decoder)
    return trace_of(log, model, np.repeat(steps, STRIDE, axis=0)[:len(log)], edge, airborne)


def trace_of(log: FlightLog, model: StreamModel, logits: np.ndarray, edge: np.ndarray, airborne: np.ndarray) -> Trace:
    """Edges with the highest probability of their crossing that led to them."""
    over, *crossing = (1.0 / (1.0 + np.exp(-logits.astype(np.float64)))).T
    recent = (model.decoder.hold_steps + model.decoder.look_back) * STRIDE
    edges = []
    for i in np.flatnonzero(edge):
        kind = int(edge[i])
        edges.append(Detection(int(i), KINDS[kind], float(crossing[kind - 1][max(i - recent, 0):i + 1].max())))
    return Trace(np.where(airborne, over, 0.0), edges, {"channels": nine_channels(log), "logits": logits})


def flight_events(log: FlightLog, model: StreamModel) -> StreamEvents:
    """One flight through the C detector."""
    return kernels.stream_detector(level_acceleration(log), log.stack(GYRO), log.stack(PWM), model.int8,
                                   model.recipe.motion, model.decoder)


def fit(
    flights: Sequence[FlightLog], seed: int = 0, *, recipe: Recipe | None = None, decoder: DecoderConfig = DECODER,
    most_flights: int | None = None, progress: Progress | None = None,
    command: str = "airtouch.detector.best.fit", **changes: Any
) -> StreamModel:
    """Train, prune and quantise; the lag is the median over the training flights. Same arguments, same bits.

    recipe: shape and training, changed by `changes` (fields of `Recipe`). decoder: its settings.
    most_flights: train on so many at most, drawn by seed.
    Raises AirTouchError without TensorFlow, without flights with edges and for unknown fields.
    """
    from airtouch.detector.stream import batches, quantisation, training
    from airtouch.detector.train import use_tensorflow

    told = progress or (lambda *_: None)
    recipe = _changed(recipe or Recipe(), changes)
    use_tensorflow(seed)
    if most_flights is not None and most_flights < len(flights):
        drawn = np.random.default_rng(seed).permutation(len(flights))[:most_flights]
        flights = [flights[i] for i in sorted(drawn)]
    prepared = []
    for i, log in enumerate(flights):
        prepared.append(batches.flight_of(log, recipe))
        told("features", i + 1, len(flights), os.path.basename(log.source))
    if not sum(len(f.edges) for f in prepared):
        raise AirTouchError("training: the flights hold no edges; give flights over a platform, with down range")
    weights = training.fit(prepared, recipe, seed, lambda done, total, note: told("steps", done, total, note))
    int8, tflite = quantisation.quantise(weights, recipe, quantisation.windows([f.x for f in prepared], recipe))
    model = StreamModel(recipe, weights, int8, tflite, {
        "detector": "best", "version": __version__, "command": command, "seed": seed, "lag_s": 0.0,
        "sigma_s": TIMING_SIGMA_S, "decoder": asdict(decoder), "flights": [os.path.basename(log.source) for log in flights]})
    found = [(logs.true_edges(log), run(log, model).edges) for log in flights]
    return replace(model, metadata={**model.metadata, "lag_s": tuning.lag(found)})


def _changed(recipe: Recipe, changes: dict[str, Any]) -> Recipe:
    try:
        return replace(recipe, **changes)
    except TypeError as error:
        raise AirTouchError(f"training: {str(error).split(') ')[-1]}; known: {', '.join(asdict(recipe))}") from None


def load(path: Path | None) -> StreamModel:
    """A model from its file, the shipped one for None; AirTouchError for any other file."""
    return model_file.load(path)


def lag_s(model: StreamModel | None) -> float:
    """The lag learnt in training, seconds."""
    return float((model or load(None)).metadata["lag_s"])


def parameters(model: StreamModel | None) -> dict[str, Any]:
    """Size, cost and settings, for reports."""
    model = model or load(None)
    return {"width": model.recipe.width, "receptive_s": model.recipe.receptive_samples / 100,
            "parameter_bytes": parameter_bytes(model.int8),
            "state_bytes": arena_bytes(model.int8),
            "mac_per_sample": model.int8.multiplications / STRIDE, **asdict(model.decoder),
            "seed": model.metadata.get("seed")}

