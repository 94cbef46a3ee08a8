"""Trains the network on rendered images; the weights that come with the package are made by this module.

    python -m airtouch.vision.training

About a minute of processor time a thousand crops at full width. Same seed, same images; TensorFlow's sums may differ in
their last bits from machine to machine.
"""

import argparse
import time
from pathlib import Path
from typing import Any

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.vision import scene as scenes
from airtouch.vision import teed
from airtouch.vision.camera import Camera, expose, exposure_s
from airtouch.vision.crossings import draw_texture
from airtouch.vision.lines import shrink
from airtouch.vision.weights import SIZES

IMAGES, STEPS, BATCH, CROP_PX = 500, 600, 8, 96  #: rendered images, training steps, crops a step, pixels of a crop
PEAK_RATE = 2e-3  #: largest learning rate of the cycle
EDGES_WEIGH = 6.0  #: weight of an edge pixel in the loss; about one pixel in thirty is an edge
SEED = 5
#: m, corners of the rendered platform; its edge lies at x = 0
CORNERS_M = np.array([[0.0, -3.0], [3.0, -3.0], [3.0, 3.0], [0.0, 3.0]])


def examples(count: int, seed: int = SEED) -> tuple[np.ndarray, np.ndarray]:
    """(count, 120, 160) binned images and whether a pixel is on the rim: 5 to 1000 lux, 2 to 12 cm over the platform,
    0.1 to 0.4 m/s, up to 25 degrees askew; in three of ten there is no edge."""
    camera = Camera()
    rng = np.random.default_rng(seed)
    images, truth = np.zeros((2, count, 120, 160), np.float32)
    for i in range(count):
        scene = scenes.Scene(draw_texture(rng), draw_texture(rng), CORNERS_M, 0.76)
        high = rng.uniform(0.02, 0.12)
        reach = 0.9 * high * camera.width / 2.0 / camera.focal_px
        x = rng.uniform(-reach, reach) if rng.uniform() < 0.7 else rng.choice([-1.0, 1.0]) * rng.uniform(3.0,
                                                                                                         9.0) * reach
        turn, speed = np.radians(rng.uniform(-25.0, 25.0)), rng.uniform(0.1, 0.4) * rng.choice([-1.0, 1.0])
        lux = float(np.exp(rng.uniform(np.log(5.0), np.log(1000.0))))
        albedo = 0.5 * float(scene.floor.mean() + scene.top.mean())
        seconds = exposure_s(camera, lux, albedo)
        level = np.array([[np.cos(turn), -np.sin(turn), 0.0], [np.sin(turn), np.cos(turn), 0.0], [0.0, 0.0, 1.0]])
        shares = scenes.subposes(camera, abs(speed), seconds, high)
        places = [np.array([x + speed * s * seconds, 0.0, 0.76 + high]) for s in shares]
        shown = scenes.blur(camera, [scenes.Pose(p, level) for p in places], scene)
        images[i] = shrink(expose(camera, shown, lux, seconds, rng))
        truth[i] = shrink(scenes.outline(camera, scenes.Pose(np.array([x, 0.0, 0.76 + high]), level), scene, 2.0)) > 0.4
    return images, truth


def train(name: str, images: np.ndarray, truth: np.ndarray, steps: int = STEPS, seed: int = SEED) -> teed.Weights:
    """Weights of one size: Adam, one cycle, weighted cross-entropy on crops. Needs TensorFlow, else AirTouchError."""
    from airtouch.detector.paper.training import one_cycle
    from airtouch.detector.shared.tensorflow import use_tensorflow

    use_tensorflow(seed)
    import keras
    from keras import ops

    def loss(goal, logit):
        each = ops.maximum(logit, 0.0) - logit * goal + ops.log1p(ops.exp(-ops.abs(logit)))
        return ops.mean(each * (1.0 + (EDGES_WEIGH - 1.0) * goal))

    model = teed.build_keras(SIZES[name])
    model.compile(keras.optimizers.Adam(PEAK_RATE), loss=loss)
    rng = np.random.default_rng(seed)
    x = teed.normalise(images)
    for step in range(steps):
        model.optimizer.learning_rate = one_cycle(step, steps, PEAK_RATE)
        chosen = rng.integers(len(x), size=BATCH)
        rows, columns = rng.integers(120 - CROP_PX + 1, size=BATCH), rng.integers(160 - CROP_PX + 1, size=BATCH)
        cut = [(i, slice(r, r + CROP_PX), slice(c, c + CROP_PX)) for i, r, c in zip(chosen, rows, columns, strict=True)]
        model.train_on_batch(np.stack([x[place] for place in cut])[..., None],
                             np.stack([truth[place] for place in cut])[..., None])
    return teed.weights_of_keras(model)


def main() -> None:
    """Train all sizes and write them beside this module."""
    images, truth = examples(IMAGES)
    print(f"{IMAGES} images rendered", flush=True)
    for name in SIZES:
        started = time.process_time()
        weights = train(name, images, truth)
        if not all(np.isfinite(w).all() for w in weights.values()):
            raise AirTouchError(f"{name}: training did not converge; another seed")
        seconds = time.process_time() - started
        path = Path(__file__).with_name(f"{name}.npz")
        halves: dict[str, Any] = {k: w.astype(np.float16) for k, w in weights.items()}
        np.savez_compressed(path, seconds=seconds, **halves)
        print(f"{path.name}: {teed.parameters(SIZES[name]):,} parameters, {seconds:.0f} s of processor time",
              flush=True)


if __name__ == "__main__":
    argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter).parse_args()
    main()
