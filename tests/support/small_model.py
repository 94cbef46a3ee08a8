"""Networks with made-up weights, for tests that need a model and no training."""

import numpy as np

from airtouch.detector.paper import network, quantisation
from airtouch.detector.paper.model import Model
from airtouch.detector.shared import pruning


def random_weights(seed: int = 0, sparsity: float = 0.0) -> dict[str, np.ndarray]:
    """Weights of the paper's network, scaled so that activations neither die nor explode."""
    rng = np.random.default_rng(seed)
    weights = {}
    for name, shape in network.weight_shapes().items():
        spread = 0.1 if name.endswith("bias") else float(np.prod(shape[:-1])) ** -0.5
        weights[name] = rng.normal(scale=spread, size=shape).astype(np.float32)
    weights["dense1.kernel"] *= pruning.keep_mask(weights["dense1.kernel"], sparsity)
    return weights


def random_windows(n: int, seed: int = 0) -> np.ndarray:
    """(n, 100, 3) float32, z-scored random walks."""
    walk = np.random.default_rng(seed).normal(size=(n, 100, 3)).cumsum(axis=1)
    return ((walk - walk.mean(axis=1, keepdims=True)) / walk.std(axis=1, keepdims=True)).astype(np.float32)


def random_model(seed: int = 0, sparsity: float = 0.0) -> Model:
    """A model of made-up weights, quantised by TensorFlow Lite."""
    weights = random_weights(seed, sparsity)
    int8, tflite = quantisation.quantise_network(weights, random_windows(200, seed + 1))
    return Model(weights, int8, tflite, {"detector": "paper", "seed": seed})
