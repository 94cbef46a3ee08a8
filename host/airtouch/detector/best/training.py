"""Training the network of `best`: long crops, one cycle of the learning rate, pruning on the way."""

import io
import json
import warnings
from collections.abc import Callable, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from airtouch.detector.best.batches import TrainingFlight, batch
from airtouch.detector.best.network import keras_model, weight_names, weight_shapes
from airtouch.detector.best.outputs import OUTPUTS
from airtouch.detector.best.recipe import ROW_STRIDE, Recipe
from airtouch.detector.shared.pruning import BLOCK, keep_mask, polynomial_sparsity
from airtouch.logs.files import write_bytes

#: shares of the steps between which the zeros grow; no source: after the rise of the learning rate, and early enough
#: that the last quarter mends what pruning costs
PRUNE_FROM, PRUNE_TO = 0.3, 0.75
KEEP_EVERY = 100  #: steps between two saved states; no source: round number, no effect on the weights
RANK_EVERY = 20  #: steps between two rankings of the weights; no source: round number
#: fields of a recipe that the compiled training step depends on; the others are of crops and pruning
COMPILED = ("width", "first_taps", "taps", "dilations", "warm_up", "steps", "peak_rate", "weight_decay", "event_weight")

Weights = dict[str, np.ndarray]


def fit(flights: Sequence[TrainingFlight], recipe: Recipe, seed: int,
        progress: Callable[[int, int, str], None] = lambda *_: None, *,
        free_air: Sequence[TrainingFlight] = (), start: Weights | None = None, resume: Path | None = None) -> Weights:
    """Float weights (`network.weight_shapes`) trained on the flights; same arguments, same bits.

    The order of TensorFlow's sums, and so the bits, depends on how many threads it has: all processors, or
    TF_NUM_INTRAOP_THREADS.
    free_air: flights without edges. start: weights to go on from; their zeros stay, and nothing more is pruned.
    resume: file that holds the state, written every KEEP_EVERY steps; a call with the same arguments goes on from
    there, to the same bits. It is removed at the end.
    Call `shared.tensorflow.use_tensorflow(seed)` before.
    """
    import tensorflow as tf

    rng, names = np.random.default_rng(seed), weight_names(recipe.graph)
    drawn = keras_model(recipe.graph).get_weights()
    model, optimizer, _, masks, learn = _learner(recipe, drawn if start is None else [
        start[name].reshape(value.shape) for name, value in zip(names, drawn, strict=True)])
    for name, variable, mask in zip(names, model.trainable_variables, masks, strict=True):
        mask.assign(_mask(variable.numpy(), start is not None and name in _pruned_names(recipe)))

    losses, last_rank = [], int(np.ceil(PRUNE_TO * recipe.steps))
    state = [*model.trainable_variables, *optimizer.variables, *masks]
    first = _resume(resume, state, rng) if resume else 0
    for step in range(first, recipe.steps):
        losses.append(float(learn(*map(tf.constant, batch(flights, recipe, rng, free_air)))))
        if start is None and (step % RANK_EVERY == 0 or step == last_rank):
            _prune(model, masks, recipe, step / recipe.steps)
        if resume and (step + 1) % KEEP_EVERY == 0:
            _save_state(resume, state, rng, step + 1)
        if (step + 1) % 50 == 0:
            progress(step + 1, recipe.steps, f"loss {np.mean(losses[-50:]):.3f}")
    for variable, mask in zip(model.trainable_variables, masks, strict=True):
        variable.assign(variable * mask)
    if resume:
        resume.unlink(missing_ok=True)
    shapes = weight_shapes(recipe.graph)  # the head's kernel has a tap for each layer that it reads
    return {name: v.numpy().reshape(shapes[name]) for name, v in zip(names, model.trainable_variables, strict=True)}


class Learner(NamedTuple):
    """A Keras model with what trains it; all of one recipe share it."""

    model: Any
    optimizer: Any
    optimizer_start: list[np.ndarray]  #: values of the optimizer's variables before the first step
    masks: list  #: TensorFlow variables, one a weight: 0 where it is pruned, 1 elsewhere
    learn: Callable  #: learn(x, y) takes one step on a batch and returns its loss


def _learner(recipe: Recipe, weights: list[np.ndarray]) -> Learner:
    """The learner of a recipe with these weights, before the first step."""
    learner = compiled_step(Recipe(**{name: getattr(recipe, name) for name in COMPILED}))
    learner.model.set_weights(weights)
    for variable, value in zip(learner.optimizer.variables, learner.optimizer_start, strict=True):
        variable.assign(value)
    return learner


# all folds of a cross-validation, and most ablations, share one: compiling takes as long as 100 steps
@lru_cache(maxsize=4)
def compiled_step(recipe: Recipe) -> Learner:
    """The learner of a recipe that differs from the default in COMPILED alone, with a compiled step."""
    import keras
    import tensorflow as tf

    model = keras_model(recipe.graph)
    rise = recipe.steps // 6
    rate = keras.optimizers.schedules.CosineDecay(
        recipe.peak_rate / 20, recipe.steps - rise, alpha=1e-3, warmup_target=recipe.peak_rate, warmup_steps=rise)
    optimizer = keras.optimizers.AdamW(rate, weight_decay=recipe.weight_decay, global_clipnorm=1.0)
    optimizer.build(model.trainable_variables)
    masks = [tf.Variable(tf.ones_like(v), trainable=False) for v in model.trainable_variables]
    weight = tf.constant([output.weight(recipe) for output in OUTPUTS])
    scored = recipe.warm_up // ROW_STRIDE

    @tf.function(jit_compile=True)
    def learn(x, y):  # noqa: ANN001, ANN202
        with tf.GradientTape() as tape:
            loss = tf.nn.sigmoid_cross_entropy_with_logits(y, model(x, training=True))[:, scored:]
            loss = tf.reduce_mean(tf.reduce_sum(loss * weight, -1))
        gradient = tape.gradient(loss, model.trainable_variables)
        optimizer.apply_gradients(zip(gradient, model.trainable_variables, strict=True))
        for variable, mask in zip(model.trainable_variables, masks, strict=True):
            variable.assign(variable * mask)
        return loss

    return Learner(model, optimizer, [v.numpy() for v in optimizer.variables], masks, learn)


def _save_state(path: Path, state: Sequence, rng: np.random.Generator, step: int) -> None:
    """Write the state of the training, whole or not at all."""
    arrays: dict[str, Any] = {f"v{i}": np.asarray(v) for i, v in enumerate(state)}
    buffer = io.BytesIO()
    np.savez(buffer, step=step, rng=json.dumps(rng.bit_generator.state), **arrays)
    write_bytes(buffer.getvalue(), path, force=True)


def _resume(path: Path, state: Sequence, rng: np.random.Generator) -> int:
    """Set variables and random numbers to the saved state; the next step, 0 without one, with a warning if damaged."""
    if not path.is_file():
        return 0
    try:
        with np.load(path) as saved:
            values = [saved[f"v{i}"] for i in range(len(state))]
            if [value.shape for value in values] != [tuple(variable.shape) for variable in state]:
                raise ValueError("arrays of another shape")
            step = int(saved["step"])
            rng.bit_generator.state = json.loads(str(saved["rng"]))
    except Exception as error:  # a damaged zip or array header raises nearly anything
        warnings.warn(f"{path}: damaged ({error}); the training starts anew", stacklevel=2)
        return 0
    for variable, value in zip(state, values, strict=True):
        variable.assign(value)
    return step


def _prune(model, masks: list, recipe: Recipe, position: float) -> None:  # noqa: ANN001
    """Set the masks of the inner layers to the sparsity that the schedule wants now."""
    part = np.clip((position - PRUNE_FROM) / (PRUNE_TO - PRUNE_FROM), 0.0, 1.0)
    sparsity = polynomial_sparsity(float(part), 1.0, 0.0, recipe.sparsity)
    if sparsity == 0.0 or position >= PRUNE_TO + 1.0 / recipe.steps:
        return
    pruned = _pruned_names(recipe)
    for name, variable, mask in zip(weight_names(recipe.graph), model.trainable_variables, masks, strict=True):
        if name in pruned:
            values = variable.numpy()
            flat = values.reshape(-1, values.shape[-1])
            mask.assign(keep_mask(flat, sparsity).reshape(values.shape))


def _pruned_names(recipe: Recipe) -> list[str]:
    """The names of the weights of which pruning sets blocks to zero."""
    return [f"{layer.name}.kernel" for layer in recipe.graph if layer.pruned]


def _mask(values: np.ndarray, pruned: bool) -> np.ndarray:
    """float32 0 where a pruned kernel (taps, in, out) has a block of four zeros along its inputs, 1 elsewhere."""
    if not pruned:
        return np.ones_like(values)
    blocks = values.reshape(-1, BLOCK, values.shape[-1]).any(axis=1)
    return np.repeat(blocks, BLOCK, axis=0).reshape(values.shape).astype(np.float32)
