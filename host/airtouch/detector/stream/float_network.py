"""The streaming network in float, as trained: what the int8 one is measured against."""

import numpy as np

from airtouch.detector.stream.recipe import STRIDE, Recipe


def float_logits(weights: dict[str, np.ndarray], recipe: Recipe, x: np.ndarray) -> np.ndarray:
    """Logits (ceil(n / 2), 3) of channels (n, 12); row j uses samples up to 2 j, zeros before the first."""
    rows = []
    y = np.asarray(x, dtype=np.float64)
    for i, (taps, _, _) in enumerate(recipe.shapes[:-1]):
        dilation = (1, *recipe.dilations)[i]
        padded = np.vstack([np.zeros(((taps - 1) * dilation, y.shape[1])), y])
        kernel = weights[f"layer{i}.kernel"]
        y = sum(padded[k * dilation:][:len(y)] @ kernel[k] for k in range(taps)) + weights[f"layer{i}.bias"]
        y = np.maximum(y, 0.0)[::STRIDE if i == 0 else 1]
        rows += [y] if i else []
    last = len(recipe.shapes) - 1
    head = weights[f"layer{last}.kernel"].reshape(-1, recipe.shapes[-1][-1])
    return np.hstack(rows) @ head + weights[f"layer{last}.bias"]
