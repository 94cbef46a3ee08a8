"""The `best` detector: a small causal network that runs on a stream of motion channels.

One step a sample in C (`firmware/kernels/stream_detector.h`): motion channels, int8 network
(`gap8/kernels/stream_int8.h`), decoder. Nothing waits for a window to fill.
"""

from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from airtouch import kernels
from airtouch.detector.best import model as model_file
from airtouch.detector.best import sensor_note
from airtouch.detector.best.batches import channels_of
from airtouch.detector.best.model import BestModel
from airtouch.detector.best.network import float_logits
from airtouch.detector.best.recipe import ROW_STRIDE
from airtouch.detector.shared import sensors
from airtouch.detector.shared.channels import nine_channels
from airtouch.detector.trace import Detection, Trace
from airtouch.kernels.network import parameter_bytes
from airtouch.kernels.stream import arena_bytes
from airtouch.kernels.stream_detector import StreamEvents
from airtouch.logs.flight_log import FlightLog
from airtouch.parameters import SAMPLE_RATE_HZ
from airtouch.reference.edge_decoder import LOGITS, DecoderConfig

#: Chosen over the five folds with models of three seeds, by tools/detectors/choose_decoder.py (host/docs/looks.md).
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
#: s, rms timing error of held-out flights, all sensors, three seeds of the recipe of 2026-11-21 (printed by the same
#: tool); for maps. Assumed for each model since.
TIMING_SIGMA_S = 0.10
SPARE_SENSORS = 1  #: of acceleration, rates and motors, one may be missing
KINDS = {1: "entry", 2: "exit"}  #: the decoder's code of an edge -> its kind


def run(log: FlightLog, model: BestModel | None = None) -> Trace:
    """P(over a platform) and edges of one flight, by the sensors that the log has; None is the shipped model.

    Raises AirTouchError, naming columns, where more than one of acceleration, rates and motors is missing.
    """
    model = model_for(model, log)
    events = flight_events(log, model)
    return trace_of(log, model, events.logits, events.edge, events.airborne)


def model_for(model: BestModel | None, log: FlightLog) -> BestModel:
    """The model that serves this log; the shipped one (None) has others for logs that lack a sensor."""
    return (model or load(None)).serving(sensors.missing_sensors(log))


def run_float(log: FlightLog, model: BestModel | None = None) -> Trace:
    """The trace of `run` by the float network, before quantisation; the difference is the cost of quantisation."""
    model = model_for(model, log)
    x, airborne = channels_of(log, model.recipe.motion)
    steps = float_logits(model.weights, model.recipe.graph, x)
    edge = np.zeros(len(log), dtype=np.uint8)
    edge[::ROW_STRIDE] = kernels.edge_decoder(steps[:, :len(LOGITS)], airborne[::ROW_STRIDE],
                                          model.decoder_without(sensors.missing_sensors(log)))
    return trace_of(log, model, np.repeat(steps, ROW_STRIDE, axis=0)[:len(log)], edge, airborne)


def trace_of(log: FlightLog, model: BestModel, logits: np.ndarray, edge: np.ndarray, airborne: np.ndarray) -> Trace:
    """The trace of one flight of n samples; an edge's probability is the highest one, of its kind, that led to it.

    logits: (n, outputs). edge: (n,) 0, or a key of KINDS where the decoder reports an edge. airborne: (n,) bool.
    """
    over, *crossing = (1.0 / (1.0 + np.exp(-logits.astype(np.float64)))).T
    absent = sensors.missing_sensors(log)
    decoder = model.decoder_without(absent)
    recent = (decoder.hold_steps + decoder.look_back) * ROW_STRIDE
    edges = []
    for i in np.flatnonzero(edge):
        kind = int(edge[i])
        edges.append(Detection(int(i), KINDS[kind], float(crossing[kind - 1][max(i - recent, 0):i + 1].max())))
    signals = {"logits": logits} if absent else {"channels": nine_channels(log), "logits": logits}
    return Trace(np.where(airborne, over, 0.0), edges, signals,
                 sensor_note.note(absent, bool(absent) and model_file.is_shipped(model, absent),
                                  sensors.columns_missing_in_part(log, absent)))


def flight_events(log: FlightLog, model: BestModel) -> StreamEvents:
    """Logits and edges of one flight, by the C detector; a missing sensor's channels are silent.

    Raises AirTouchError, naming columns, where more than one sensor is missing.
    """
    logged = sensors.signals(log)
    return kernels.stream_detector(logged.acc, logged.gyro, logged.pwm, model.int8,
                                   sensors.silence(model.recipe.motion, logged.missing),
                                   model.decoder_without(logged.missing))


def load(path: Path | None) -> BestModel:
    """A model from its file, the shipped one for None; AirTouchError for any other file."""
    return model_file.load(path)


def lag_s(model: BestModel | None) -> float:
    """The lag learnt in training, seconds."""
    return float((model or load(None)).metadata["lag_s"])


def arm_pwm(model: BestModel | None) -> float:
    """Mean PWM above which the model takes the vehicle to be in the air: of the vehicle that it was trained for."""
    return (model or load(None)).recipe.motion.arm_pwm


def parameters(model: BestModel | None) -> dict[str, Any]:
    """Numbers by name, for reports: size, cost, settings of the decoder, seed."""
    model = model or load(None)
    return {"width": model.recipe.width, "receptive_s": model.recipe.receptive_samples / SAMPLE_RATE_HZ,
            "parameter_bytes": parameter_bytes(model.int8),
            "state_bytes": arena_bytes(model.int8),
            "mac_per_sample": model.int8.multiplications / ROW_STRIDE, **asdict(model.decoder),
            "seed": model.metadata.get("seed")}

