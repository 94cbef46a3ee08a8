"""Training the paper's network on flights (sections 5.2, 5.3 and 7.1)."""

import hashlib
import os
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from airtouch import __version__, logs
from airtouch.detector.evaluation.score import over_platform
from airtouch.detector.paper import network, normalisation, quantisation
from airtouch.detector.paper.features import Features, feature_windows, flight_features
from airtouch.detector.paper.losses import edge_loss
from airtouch.detector.paper.model import Model
from airtouch.detector.paper.recipe import PaperRecipe
from airtouch.detector.shared import training_set
from airtouch.detector.shared.tensorflow import use_tensorflow
from airtouch.errors import AirTouchError
from airtouch.kernels.network import infer_float, infer_int8
from airtouch.logs.flight_log import FlightLog
from airtouch.parameters import DEFAULT
from airtouch.vehicle import arm_pwm_of

if TYPE_CHECKING:
    import keras

BATCH = 128  #: windows a batch; 32 in the paper
HELD_OUT = 0.15  #: fraction of the flights held out for early stopping; no source: round number
PRUNED_BY = 0.6  #: fraction of the steps after which the pruning masks are fixed; no source: leaves time to recover
PATIENCE = 3  #: epochs without a lower loss on the held-out flights, until training stops; no source: round number
PEAK_RATE = 2e-3  #: largest learning rate of the cycle; no source: round number
BATCHES_A_CALL = 50  #: batches between two returns to Python, for speed
WINDOW_STEP = 4  #: every fourth window is used: neighbours differ by one sample in a hundred

#: progress(stage, done, total, note), stage "features" (flights) or "epochs"
Progress = Callable[[str, int, int, str], None]


@dataclass(frozen=True)
class Windows:
    """n training windows.

    x: (n, 100, 3) float32, each column normalised (`normalisation`). over: (n,) 1.0 where the last sample is over a
    platform. alert: (n,) 1.0 where the disturbance force reached its threshold there.
    flight: (n,) index of the flight.
    """

    x: np.ndarray
    over: np.ndarray
    alert: np.ndarray
    flight: np.ndarray

    def select(self, chosen: np.ndarray) -> "Windows":
        """The windows where `chosen` (n,) is True."""
        return Windows(self.x[chosen], self.over[chosen], self.alert[chosen], self.flight[chosen])


def train_paper(flights: Sequence[FlightLog], seed: int = 0, recipe: PaperRecipe | None = None, *,
                progress: Progress | None = None, command: str = "airtouch.detector.paper.training.train_paper",
                **changes: Any) -> Model:
    """A model trained on the flights, pruned and quantised; the same arguments give the same bits on one machine.

    flights: with down range, for the true edges; some of them, drawn by the seed, are held out to stop early
    (`held_out`). recipe: `PaperRecipe()` for None; changes: fields of it, by name. progress: called as the training
    goes; None for silence. command: what the model's metadata names as its origin.
    The decoding settings and the lag are not chosen yet (`detector.tune`).
    Raises AirTouchError without TensorFlow, without a usable window and for settings that are unknown or out of
    range.
    """
    known = [field.name for field in fields(PaperRecipe)]
    absent = changes.keys() - set(known)
    if absent:
        raise AirTouchError(f"training: no setting {min(absent)!r}; known: {', '.join(known)}")
    recipe = replace(recipe or PaperRecipe(), **changes)
    use_tensorflow(seed)
    report = progress or (lambda *_: None)
    features = features_of(flights, report)
    scale = None
    if recipe.fixed_scale:
        scale = normalisation.fit([f.fused[logs.airborne(log, arm_pwm_of(log.meta))]
                                   for log, f in zip(flights, features, strict=True)])
    windows = join([windows_of(log, f, i, scale) for i, (log, f) in enumerate(zip(flights, features, strict=True))])
    validation = held_out(len(flights), seed)
    in_training = ~np.isin(windows.flight, validation)
    if not in_training.any() or len(np.unique(windows.over[in_training])) < 2:
        raise AirTouchError("training: the flights hold no windows both over and beside a platform; "
                            "give more flights")
    weights, epochs_run = fit_windows(windows.select(in_training), windows.select(~in_training), recipe, report)
    int8, tflite = quantisation.quantise_network(weights, windows.x[in_training])
    hashes = [training_set.flight_hash(log) for log in flights]
    model = Model(weights, int8, tflite, {
        "detector": "paper", "version": __version__, "command": command, "parameters": asdict(DEFAULT),
        "seed": seed, "epochs": recipe.epochs, "epochs_run": epochs_run, "sparsity": recipe.sparsity,
        "block": recipe.block, "lambda": recipe.df_lambda, "conv_sparsity": recipe.conv_sparsity,
        "flights": [os.path.basename(log.source) for log in flights], "flight_hashes": hashes,
        "held_out": [os.path.basename(flights[i].source) for i in validation],
        "held_out_hashes": [hashes[i] for i in validation], "data_sha256": data_hash(windows),
    }, scale)
    score = accuracy(model, windows.select(~in_training & (np.arange(len(in_training)) % WINDOW_STEP == 0)))
    return replace(model, metadata={**model.metadata, "held_out_accuracy": score})


def features_of(flights: Sequence[FlightLog], progress: Progress) -> list[Features]:
    """The features of every flight."""
    features = []
    for index, log in enumerate(flights):
        features.append(flight_features(log))
        progress("features", index + 1, len(flights), os.path.basename(log.source))
    return features


def training_windows(flights: Sequence[FlightLog], progress: Progress) -> Windows:
    """Every full window of every flight that ends in the air, z-scored by itself."""
    return join([windows_of(log, f, i)
                 for i, (log, f) in enumerate(zip(flights, features_of(flights, progress), strict=True))])


def join(parts: Sequence[Windows]) -> Windows:
    """All windows of several flights. Raises AirTouchError without any."""
    if not sum(len(part.x) for part in parts):
        raise AirTouchError("training: no flight holds a full window in the air; "
                            "3 s of flight at 100 Hz are needed")
    return Windows(*(np.concatenate([getattr(part, name) for part in parts])
                     for name in ("x", "over", "alert", "flight")))


def windows_of(log: FlightLog, features: Features, index: int = 0, scale: normalisation.FixedScale | None = None,
               rows: int = DEFAULT.feature_window) -> Windows:
    """The training windows of one flight, `rows` samples each, z-scored by themselves or on a fixed scale."""
    x, ends = feature_windows(features.fused, rows, scale)
    arm_pwm = arm_pwm_of(log.meta)
    flying = logs.airborne(log, arm_pwm)[ends]
    x, ends = x[flying], ends[flying]
    over = over_platform(logs.true_edges(log, arm_pwm=arm_pwm), len(log))
    return Windows(x, over[ends].astype(np.float32), features.alert[ends].astype(np.float32),
                   np.full(len(ends), index, np.int32))


def held_out(flights: int, seed: int) -> np.ndarray:
    """Sorted indices of the flights held out for early stopping; empty for fewer than four flights."""
    if flights < 4:
        return np.zeros(0, dtype=int)
    return np.sort(np.random.default_rng(seed).permutation(flights)[:max(1, round(HELD_OUT * flights))])


def accuracy(model: Model, windows: Windows) -> dict[str, float | int | None]:
    """Balanced window accuracy of the float and the int8 network, 0 to 1; None without both classes."""
    result: dict[str, float | int | None] = {"windows": len(windows.x), "float": None, "int8": None}
    if len(np.unique(windows.over)) == 2:
        for name, logits in (("float", infer_float(model.float_layers, windows.x)),
                             ("int8", infer_int8(model, windows.x))):
            predicted = logits[:, 1] > logits[:, 0]
            result[name] = float(np.mean([np.mean(predicted[windows.over == c] == c) for c in (0.0, 1.0)]))
    return result


def data_hash(windows: Windows) -> str:
    """SHA-256 of the training windows and their labels."""
    total = hashlib.sha256()
    for values in (windows.x, windows.over, windows.alert, windows.flight):
        total.update(np.ascontiguousarray(values).tobytes())
    return total.hexdigest()


def class_weights(over: np.ndarray) -> tuple[float, float]:
    """Weights in the loss of a window beside and of one over a platform; with them both classes have equal weight."""
    share = float(np.clip(np.mean(over), 1e-3, 1.0 - 1e-3))
    return 0.5 / (1.0 - share), 0.5 / share


def one_cycle(step: float, steps: float, peak: float = PEAK_RATE) -> float:
    """Learning rate: cosine from peak / 25 up over 30 % of the steps, down to peak / 10^4 (Smith 2018)."""
    position = min(step / steps, 1.0)
    if position < 0.3:
        start, stop, part = peak / 25.0, peak, position / 0.3
    else:
        start, stop, part = peak, peak / 1e4, (position - 0.3) / 0.7
    return stop + (start - stop) * 0.5 * (1.0 + float(np.cos(np.pi * part)))


def fit_windows(train: Windows, validation: Windows, recipe: PaperRecipe,
                progress: Progress) -> tuple[dict[str, np.ndarray], int]:
    """The trained weights, and the number of epochs until the training stopped."""
    model, losses = fit_keras(train, validation, recipe, progress)
    return network.weights_of_keras(model), len(losses)


def fit_keras(train: Windows, validation: Windows, recipe: PaperRecipe,
              progress: Progress) -> tuple["keras.Model", list[float]]:
    """The trained Keras model, and the loss on the held-out windows after each epoch.

    Without held-out windows it is the loss on the training windows. Without sparsity windows may have any length: the
    masks of pruning are made for the kernels of the shipped network, whose first dense layer grows with the window.
    """
    import keras

    train, validation = (part.select(np.arange(len(part.x)) % WINDOW_STEP == 0) for part in (train, validation))
    batches, epochs = max(len(train.x) // BATCH, 1), recipe.epochs
    pruned_epochs = max(int(np.ceil(PRUNED_BY * epochs)), 1)
    constraints, callbacks = {}, []
    shares = {network.PRUNED: recipe.sparsity, network.PRUNED_CONV: recipe.conv_sparsity}
    shares = {name: share for name, share in shares.items() if share > 0}
    if shares:
        constraints, schedule = network.pruning_of(shares, batches * pruned_epochs, recipe.block)
        callbacks = [schedule]
    model = network.build_keras(constraints, train.x.shape[1])
    rate = _rate_table(batches * epochs)
    model.compile(keras.optimizers.Adam(rate), loss=edge_loss(recipe.df_lambda, class_weights(train.over)),
                  steps_per_execution=min(BATCHES_A_CALL, batches))
    stopping = keras.callbacks.EarlyStopping(patience=PATIENCE, restore_best_weights=True,
                                             start_from_epoch=pruned_epochs)
    report = keras.callbacks.LambdaCallback(
        on_epoch_end=lambda epoch, losses: progress("epochs", epoch + 1, epochs, f"loss {losses['loss']:.3f}"))
    callbacks += [report] + ([stopping] if len(validation.x) else [])
    history = model.fit(_batches(train, shuffle=True), epochs=epochs, verbose=0, callbacks=callbacks,
                        shuffle=False,
                        validation_data=_batches(validation, shuffle=False) if len(validation.x) else None)
    return model, history.history["val_loss" if len(validation.x) else "loss"]


def _rate_table(steps: int):
    """A Keras schedule of the learning rate: one cycle over the steps."""
    import keras
    from keras import ops

    table = np.array([one_cycle(step, steps) for step in range(steps + 1)], dtype=np.float32)

    class OneCycle(keras.optimizers.schedules.LearningRateSchedule):
        def __call__(self, step):
            return ops.take(table, ops.minimum(ops.cast(step, "int32"), steps))

    return OneCycle()


def _batches(windows: Windows, shuffle: bool):
    """Cached windows in batches; the order of each epoch follows from the seed."""
    import tensorflow as tf

    x = tf.constant(windows.x[..., None])
    target = tf.constant(np.column_stack([windows.over, windows.alert]))
    order = tf.data.Dataset.range(len(windows.x)).cache()
    if shuffle:
        order = order.shuffle(len(windows.x), reshuffle_each_iteration=True)
    order = order.batch(BATCH, drop_remainder=shuffle and len(windows.x) >= BATCH)
    return order.map(lambda i: (tf.gather(x, i), tf.gather(target, i))).prefetch(4)
