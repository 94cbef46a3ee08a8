"""The paper's pipeline, faithfully: fused features, int8 network, edges, physical filter.

All of it through the C that flies: `kernels.edge_pipeline` for features, disturbance
force, FR-CFAR, decoding and filter, `kernels.network` for the int8 network.
"""

import itertools
import os
from collections.abc import Sequence
from dataclasses import asdict, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from airtouch import logs
from airtouch import vehicle as vehicles
from airtouch.detector.evaluation import tuning
from airtouch.detector.paper import model as model_file
from airtouch.detector.paper.decoding import decode, detections
from airtouch.detector.paper.decoding import physical_filter as filtered
from airtouch.detector.paper.features import Features, feature_windows, flight_features, pipeline
from airtouch.detector.paper.model import Model
from airtouch.detector.shared import training_set
from airtouch.detector.trace import Detection, Trace
from airtouch.errors import AirTouchError, printable
from airtouch.kernels.network import (
    arena_bytes,
    infer_float,
    parameter_bytes,
    platform_probability,
    probability_of_flight,
)
from airtouch.kernels.rolling import answers_of_samples, held, probability_of_samples, rolling_size
from airtouch.logs.flight_log import FlightLog
from airtouch.parameters import DEFAULT, Parameters
from airtouch.reference.networks.int8_network import multiplications

#: The grid of decoding settings that `tune` searches. The paper gives none, so it is chosen from the training flights.
ENTRY_GRID = (0.5, 0.6, 0.7, 0.8, 0.9, 0.95)  #: P(over a platform) at which an entry is reported
EXIT_GRID = (0.05, 0.1, 0.2, 0.3, 0.4, 0.5)  #: P(over a platform) at which an exit is reported
DWELL_GRID = (25, 50, 100, 150)  #: samples (10 ms) between two edges, at least
HOLD_GRID = (25, 50, 100, 200)  #: samples for which an alert of FR-CFAR confirms an edge
#: One flight: P(over a platform), whether edges may be reported, alert of FR-CFAR; (n,) each.
DecodingInputs = tuple[np.ndarray, np.ndarray, np.ndarray]


def run(log: FlightLog, model: Model | None = None) -> Trace:
    """P(over a platform), (n,), and edges of one flight of n samples, with the shipped model for None.

    Raises AirTouchError that names missing columns.
    """
    model = model or load(None)
    features = flight_features(log, parameters=decoding_settings(model)[0])
    return _trace(log, model, features, probability_of(model, features.fused))


def probability_of(model: Model, fused: np.ndarray) -> np.ndarray:
    """P(over a platform), (n,), for the fused features (n, 3) of a flight; NaN until the network's window is full."""
    if model.scale is None:
        return probability_of_flight(model, fused)
    return probability_of_samples(model, fused, stride(model))


def stride(model: Model) -> int:
    """Samples between two outputs of a network that takes one sample at a time; AirTouchError for no whole number."""
    value = model.metadata.get("stride", 1)
    if not isinstance(value, int) or isinstance(value, bool) or value < 1:
        raise AirTouchError(f"the model's stride must be a whole number from 1, not {value!r}; train it again")
    return value


def run_float(log: FlightLog, model: Model | None = None) -> Trace:
    """The trace of `run` by the float network, before quantisation; the difference is the cost of quantisation."""
    model = model or load(None)
    features = flight_features(log, parameters=decoding_settings(model)[0])
    return _trace(log, model, features, _float_probability(model, features.fused))


def _float_probability(model: Model, fused: np.ndarray) -> np.ndarray:
    """`probability_of` by the float network, at the samples at which the int8 network answers."""
    probability = np.full(len(fused), np.nan)
    if model.scale is None:
        windows, at = feature_windows(fused, DEFAULT.feature_window)
    else:
        valid = answers_of_samples(model, fused, stride(model))[1]
        windows, at = _rolling_windows(model, model.scale.apply(fused), np.flatnonzero(valid))
    probability[at] = platform_probability(infer_float(model.float_layers, windows), 1.0)
    return probability if model.scale is None else held(probability, valid, fused)


def _rolling_windows(model: Model, inputs: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The windows (k, rows, c) whose answers a rolling network gives at the samples (k,) of (n, c), and these samples.

    A window ends some samples later, of which the answer does not depend: they are as the last one before them.
    """
    ahead = rolling_size(model.int8, stride(model)).ahead
    rows = np.minimum(at[:, None] + ahead + np.arange(1 - DEFAULT.feature_window, 1), at[:, None])
    return inputs[rows], at


def _trace(log: FlightLog, model: Model, features: Features, probability: np.ndarray) -> Trace:
    """The trace of a flight whose P(over a platform) is known, (n,), with edges from the C pipeline."""
    settings, physical = decoding_settings(model)
    events = pipeline(log, settings, probability, physical_filter=physical)
    return Trace(probability, detections(events.edge, probability), signals(features), _vehicle_note(log))


def _vehicle_note(log: FlightLog) -> str:
    """A line where the log names a vehicle that cannot be loaded: the force is then the default's."""
    name = vehicles.unknown_name(log.meta)
    if not name:
        return ""
    return (f"the log names vehicle {printable(name)!r}, {vehicles.why_unknown(name)}; the "
            f"disturbance force is that of {vehicles.DEFAULT_VEHICLE}")


def fit(flights: Sequence[FlightLog], seed: int = 0, *, physical_filter: bool = True, **options: Any) -> Model:
    """A model trained on the flights, with decoding settings and lag chosen on those that it held out.

    The held-out flights are those of early stopping; without any, all flights are used. physical_filter: drop edges
    without an FR-CFAR alert. options: arguments of `training.train_paper`: progress, command, and the fields of
    `PaperRecipe` (epochs, sparsity, df_lambda, ...).
    Raises as `train_paper` does.
    """
    from airtouch.detector.paper.training import train_paper

    return retune(train_paper(flights, seed=seed, **options), flights, physical_filter)


def retune(model: Model, flights: Sequence[FlightLog], physical_filter: bool = True) -> Model:
    """The same network with decoding settings and lag chosen again. flights: those of its training.

    A model of an older version holds the names of the held-out flights instead of hashes.
    """
    names, hashes = model.metadata["held_out"], model.metadata.get("held_out_hashes")
    chosen = [log for log in flights if (os.path.basename(log.source) in names if hashes is None
                                         else training_set.flight_hash(log) in hashes)]
    return tune(model, chosen or flights, physical_filter)


def tune(model: Model, flights: Sequence[FlightLog], physical_filter: bool = True) -> Model:
    """The model with the decoding settings and the lag of the best timed F1 over the flights (`tuning.timed_f1`)."""
    inputs: list[DecodingInputs] = []
    for log in flights:
        features = flight_features(log)
        inputs.append((probability_of(model, features.fused), features.armed, features.alert))
    truth = [logs.true_edges(log, arm_pwm=vehicles.arm_pwm_of(log.meta)) for log in flights]
    settings, lag, score = choose_decoding(inputs, truth, physical_filter)
    return replace(model, metadata={
        **model.metadata, "parameters": asdict(settings), "lag_s": lag, "physical_filter": physical_filter,
        "tuned_on": [os.path.basename(log.source) for log in flights], "tuned_timed_f1": score})


def choose_decoding(inputs: Sequence[DecodingInputs], truth: Sequence[Sequence[logs.Edge]], physical_filter: bool,
                    ) -> tuple[Parameters, float, float]:
    """(settings, lag in seconds, timed F1) of the best of `candidates`; truth: the true edges of each flight."""
    @cache
    def unfiltered(entry: float, leave: float, dwell: int, i: int) -> list[Detection]:
        settings = replace(DEFAULT, probability_entry=entry, probability_exit=leave, dwell_samples=dwell)
        return decode(inputs[i][0], inputs[i][1], None, settings)

    def detect(settings: Parameters, i: int) -> list[Detection]:
        edges = unfiltered(settings.probability_entry, settings.probability_exit, settings.dwell_samples, i)
        return filtered(edges, inputs[i][2], settings.alert_hold) if physical_filter else edges

    return tuning.choose(candidates(physical_filter), truth, detect)


def candidates(physical_filter: bool) -> list[Parameters]:
    """The decoding settings that tuning chooses from."""
    return [
        replace(DEFAULT, probability_entry=entry, probability_exit=leave, dwell_samples=dwell, alert_hold=hold)
        for entry, leave, dwell, hold in itertools.product(
            ENTRY_GRID, EXIT_GRID, DWELL_GRID, HOLD_GRID if physical_filter else HOLD_GRID[:1])
        if leave < entry
    ]


def load(path: Path | None) -> Model:
    """A model from its file, the shipped one for None; AirTouchError for any other file."""
    return model_file.load(path)


def lag_s(model: Model | None) -> float:
    """The lag learnt in training, seconds; 0 where the model was not tuned."""
    return float((model or load(None)).metadata.get("lag_s", 0.0))


def parameters(model: Model | None) -> dict[str, Any]:
    """Numbers by name, for reports: size, cost, pipeline and decoding settings, and how the network was trained."""
    model = model or load(None)
    metadata = model.metadata
    size = {"parameter_bytes": parameter_bytes(model.int8), "state_bytes": arena_bytes(model.int8),
            "mac_per_sample": multiplications(model.int8)}
    named = ("seed", "epochs", "epochs_run", "sparsity", "block", "lambda", "physical_filter",
             "tuned_timed_f1")
    return {**size, **metadata.get("parameters", asdict(DEFAULT)), **{k: metadata[k] for k in named if k in metadata}}


def decoding_settings(model: Model) -> tuple[Parameters, bool]:
    """The model's settings, and whether its physical filter is on.

    Raises AirTouchError for settings of another version.
    """
    try:
        return Parameters(**model.metadata["parameters"]), bool(model.metadata.get("physical_filter", True))
    except (KeyError, TypeError):
        raise AirTouchError("the model's parameters are not those of this version; train it again") from None


def signals(features: Features) -> dict[str, np.ndarray]:
    """The features that reports plot, by name: (n,) or (n, k) arrays of `Features`."""
    names = ("channels", "band_power", "fused", "force", "cfar_power", "threshold", "alert")
    return {name: getattr(features, name) for name in names}
