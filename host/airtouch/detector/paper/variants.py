"""The paper's pipeline with one of its choices changed, in float, for ablations only."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from airtouch import logs
from airtouch.detector.paper import training
from airtouch.detector.paper.decoding import decode
from airtouch.detector.paper.detector import choose_decoding
from airtouch.detector.paper.features import Features, feature_windows, flight_features
from airtouch.detector.paper.losses import DEFAULT_LAMBDA
from airtouch.detector.paper.network import float_layers
from airtouch.detector.paper.recipe import EPOCHS, PaperRecipe
from airtouch.detector.shared.tensorflow import use_tensorflow
from airtouch.detector.trace import Trace
from airtouch.errors import AirTouchError
from airtouch.kernels.network import infer_float, platform_probability
from airtouch.logs.flight_log import FlightLog
from airtouch.parameters import DEFAULT, Parameters
from airtouch.vehicle import arm_pwm_of

CONVERGED = 0.01  #: share above the lowest held-out loss that counts as converged


@dataclass(frozen=True)
class Variant:
    """A `registry.Detector`: the paper's, unpruned, with these choices; the defaults are the paper's own.

    df_lambda: weight of the disturbance-force loss. band_window: STFT window, samples. centred: take each
    band power half a window early, as a plot would; it looks into the future and cannot fly.
    rows: network input, samples. physical_filter: drop edges without an FR-CFAR alert.
    """

    df_lambda: float = DEFAULT_LAMBDA
    band_window: int = DEFAULT.band_window
    centred: bool = False
    rows: int = DEFAULT.feature_window
    physical_filter: bool = True

    def fit(self, flights: Sequence[FlightLog], seed: int = 0, epochs: int = EPOCHS) -> "VariantModel":
        """Weights from the training flights, decoding and lag from those held out among them."""
        use_tensorflow(seed)
        parts = [training.windows_of(log, self._features(log), index, rows=self.rows)
                 for index, log in enumerate(flights)]
        windows = training.join(parts)
        validation = training.held_out(len(flights), seed)
        used = ~np.isin(windows.flight, validation)
        recipe = PaperRecipe(epochs, sparsity=0.0, df_lambda=self.df_lambda)
        network, losses = training.fit_keras(windows.select(used), windows.select(~used), recipe, lambda *_: None)
        converged = int(np.flatnonzero(np.array(losses) <= (1 + CONVERGED) * min(losses))[0]) + 1
        unseen = [flights[i] for i in validation] or list(flights)
        model = VariantModel(network, DEFAULT, 0.0, converged)
        truth = [logs.true_edges(log, arm_pwm=arm_pwm_of(log.meta)) for log in unseen]
        settings, lag, _ = choose_decoding([self._decoding_inputs(log, model) for log in unseen], truth,
                                           self.physical_filter)
        return replace(model, settings=settings, lag_s=lag)

    def run(self, log: FlightLog, model: "VariantModel | None" = None) -> Trace:
        """P(over a platform) and edges of one flight."""
        if model is None:
            raise AirTouchError("a variant has no shipped model")
        probability, armed, alert = self._decoding_inputs(log, model)
        return Trace(probability, decode(probability, armed, alert if self.physical_filter else None, model.settings))

    def load(self, path: Path | None) -> "VariantModel":
        """Raises AirTouchError: the model of a variant is not saved."""
        raise AirTouchError(f"{path}: a variant's model is not saved")

    def lag_s(self, model: "VariantModel") -> float:
        """The lag learnt in training, seconds."""
        return model.lag_s

    def parameters(self, model: "VariantModel") -> dict[str, Any]:
        """What an ablation reports of training."""
        return {"converged_after_epochs": model.converged}

    def _features(self, log: FlightLog) -> Features:
        """The features of one flight, its fused ones shifted where they are `centred`."""
        features = flight_features(log, parameters=replace(DEFAULT, band_window=self.band_window))
        if not self.centred:
            return features
        early, fused = self.band_window // 2, features.fused
        shifted = np.vstack([fused[early:], np.full((early, fused.shape[1]), np.nan, fused.dtype)])
        return replace(features, fused=shifted)

    def _decoding_inputs(self, log: FlightLog, model: "VariantModel") -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """P(over) (n,), armed (n,), alerts (n,)."""
        features = self._features(log)
        x, ends = feature_windows(features.fused, self.rows)
        logits = np.asarray(model.network.predict(x[..., None], batch_size=2048, verbose=0), dtype=np.float64)
        probability = np.full(len(log), np.nan)
        probability[ends] = platform_probability(logits, 1.0)
        return probability, features.armed, features.alert


@dataclass(frozen=True)
class VariantModel:
    """A trained Keras network, its decoding, its lag in seconds, and the epochs it took to converge."""

    network: Any
    settings: Parameters
    lag_s: float
    converged: int


def random_windows(flights: Sequence[FlightLog], *, seed: int = 0, epochs: int = 10,
                   share: float = 0.2) -> dict[str, float | int]:
    """The paper's split, which leaks: windows of all flights dealt at random into training and test.

    Neighbouring windows share 99 of 100 samples, so the test set was as good as seen. share: of the windows, for the
    test. Returns balanced_accuracy of the float network on the test windows, windows tested, epochs.
    """
    use_tensorflow(seed)
    windows = training.training_windows(flights, lambda *_: None)
    test = np.random.default_rng(seed).uniform(size=len(windows.x)) < share
    nothing = windows.select(np.zeros(len(test), bool))  # to stop early on: the paper trains to the end
    weights, _ = training.fit_windows(windows.select(~test), nothing, PaperRecipe(epochs, sparsity=0.0),
                                      lambda *_: None)
    logits = infer_float(float_layers(weights), windows.x[test])
    predicted, over = logits[:, 1] > logits[:, 0], windows.over[test] > 0.5
    return {"balanced_accuracy": float(0.5 * (predicted[over].mean() + (~predicted[~over]).mean())),
            "windows": int(test.sum()), "epochs": epochs}
