"""Table 2: operations, parameters, training time and memory of AirTouch and of the camera."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from airtouch.detector import best, paper
from airtouch.kernels.network import parameter_bytes
from airtouch.paper_figures import pictures, recorded, words
from airtouch.paper_figures.claims import CLAIMS, UNTESTABLE
from airtouch.paper_figures.figure import Figure, Job, Missing, Verdict
from airtouch.parameters import DEFAULT
from airtouch.reference.networks.int8_network import CONV, multiplications
from airtouch.vision import teed, weights
from airtouch.vision.camera import Camera

PAPER_CAMERA = (320, 320)  #: rows and columns that the paper states for its camera
PAPER_FRAME_BITS = 8 * PAPER_CAMERA[0] * PAPER_CAMERA[1]
WINDOW_BITS = 32 * 3 * DEFAULT.feature_window  #: three channels of features in float
FLOPS_A_MAC = 2
NETWORKS = "the paper's network and the camera's (TEED's structure)"  #: what verdicts here are on


def resources(job: Job) -> Figure:
    """Table 2: the paper's network, `best` and a network with TEED's structure, counted from their shapes."""
    counts = _count()
    rows = _rows(counts)
    verdicts = {"flops": _flops(counts), "parameters": _parameters(counts),
                "training": _training(job, rows, counts.vision_seconds), "memory": _memory()}
    caption = ("Counted from the networks' shapes, not measured. The vision network is written anew with TEED's "
               "structure; three colours as published. Training is of one model, processor time here and the paper's "
               "own minutes elsewhere: its machine is not named.")
    return Figure("Resources", rows, caption, verdicts, lambda canvas: _draw(canvas, rows))


@dataclass(frozen=True)
class _Counts:
    """What the shapes of the three networks say; multiplications are of one window, frame or step."""

    weights: int  #: weights and biases of the paper's network
    shipped_bytes: int
    multiplications: int
    dense_multiplications: int  #: without the zeros of pruning left out
    vision_multiplications: int
    vision_parameters: int
    vision_seconds: float  #: of processor time, its training
    best: dict[str, int]


def _count() -> _Counts:
    ours = paper.load(None)
    return _Counts(sum(int(np.size(w)) for w in ours.weights.values()), parameter_bytes(ours.int8),
                   multiplications(ours.int8), _dense_multiplications(ours),
                   teed.multiplications(*PAPER_CAMERA, colours=3), teed.parameters(colours=3), weights.load("teed")[1],
                   best.parameters(best.load(None)))


def _rows(n: _Counts) -> list[dict[str, Any]]:
    """The table's rows: the vision network, the paper's without and with zeros, and `best`."""
    step = n.best["mac_per_sample"]
    return [
        {"what": "TEED's structure, 320 x 320", "mac": n.vision_multiplications,
         "flops": FLOPS_A_MAC * n.vision_multiplications, "parameters": n.vision_parameters,
         "parameter_bytes": 4 * n.vision_parameters, "training_s": n.vision_seconds, "frame_bits": PAPER_FRAME_BITS},
        {"what": "paper's network, no zeros", "mac": n.dense_multiplications,
         "flops": FLOPS_A_MAC * n.dense_multiplications, "parameters": n.weights, "parameter_bytes": 4 * n.weights,
         "frame_bits": WINDOW_BITS},
        {"what": "paper's network as shipped", "mac": n.multiplications, "flops": FLOPS_A_MAC * n.multiplications,
         "parameters": n.weights, "parameter_bytes": n.shipped_bytes, "frame_bits": WINDOW_BITS},
        {"what": "best, a step of 10 ms", "mac": step, "flops": FLOPS_A_MAC * step,
         "parameter_bytes": n.best["parameter_bytes"], "frame_bits": 8 * n.best["state_bytes"]}]


def _flops(n: _Counts) -> Verdict:
    """The verdict on the multiply-accumulates of the paper's network and of the vision network."""
    theirs, said = CLAIMS["flops"].values
    vision = n.vision_multiplications
    side = np.sqrt(theirs / FLOPS_A_MAC / (vision / np.prod(PAPER_CAMERA)))
    return words.verdict(
        words.near(n.dense_multiplications, said) and words.near(FLOPS_A_MAC * vision, theirs),
        f"paper's network {n.dense_multiplications / 1e6:.2f} million multiply-accumulates without zeros (the paper's "
        f"0.28 counts these), {n.multiplications / 1e6:.2f} as shipped; TEED at 320 x 320 "
        f"{FLOPS_A_MAC * vision / 1e6:,.0f} million FLOPs, {vision / 1e6:,.0f} million multiply-accumulates; 3900 "
        f"million FLOPs are those of an image of {side:.0f} x {side:.0f}. 0.28 of 3900 is 0.007 %, as the text says, "
        "not the table's 0.07 %", NETWORKS)


def _parameters(n: _Counts) -> Verdict:
    theirs, said = CLAIMS["parameters"].values
    return words.verdict(n.shipped_bytes <= said and words.near(n.vision_parameters, theirs),
                         f"{n.shipped_bytes:,} bytes as shipped; TEED has {n.vision_parameters:,} weights and biases: "
                         f"58 kB at one byte each, {4 * n.vision_parameters:,} bytes in float", NETWORKS)


def _memory() -> Verdict:
    camera, ring_bits = Camera(), 32 * 9 * DEFAULT.band_window
    frame_bits = 8 * camera.width * camera.height
    return words.verdict(WINDOW_BITS <= CLAIMS["memory"].values[0] and max(frame_bits, PAPER_FRAME_BITS) >= 1e6,
                         f"a window of features {WINDOW_BITS:,} bits, {ring_bits:,} with the samples of its band "
                         f"power; a frame of 324 x 244 {frame_bits:,} bits, of 320 x 320 {PAPER_FRAME_BITS:,}: less "
                         "than a million, not millions", "the paper's method and the camera")


def _draw(canvas: Any, rows: list[dict[str, Any]]) -> None:
    """Draw work, parameters and memory of each row as bars."""
    paper_colour, best_colour = pictures.COLOURS["paper"], pictures.COLOURS["best"]
    for axes, key, label in zip(canvas.subplots(1, 3), ("mac", "parameter_bytes", "frame_bits"),
                                ("multiply-accumulates", "bytes of parameters", "bits a frame or window"),
                                strict=True):
        axes.bar(range(len(rows)), [r[key] for r in rows],
                 color=[pictures.GREY, paper_colour, paper_colour, best_colour])
        axes.set_yscale("log")
        axes.set_xticks(range(len(rows)), ["vision", "paper,\nno zeros", "paper", "best"], fontsize=7)
        axes.set_title(label)


def _training(job: Job, rows: list[dict[str, Any]], vision_seconds: float) -> Verdict:
    """The training times of a fold of the paper's network and of the vision network; never judged.

    The paper's machine, epochs and images are not those of this run.
    """
    text = f"vision network {vision_seconds / 60:.1f} min of processor time on rendered images"
    try:
        _, folds = recorded.scores(job, "paper")
    except Missing:
        return Verdict(UNTESTABLE, f"{text}; {Missing('no recorded flights here to train the paper’s network on')}")
    durations = [f.cpu_seconds for f in folds if f.cpu_seconds is not None] or [f.seconds for f in folds]
    seconds = float(np.mean(durations))
    rows[1]["training_s"] = seconds
    return Verdict(UNTESTABLE, f"the paper's machine is not named; paper's network {seconds / 60:.1f} min of processor "
                               f"time a fold here (n = {len(durations)}, choice of thresholds and scoring included, "
                               f"{folds[0].parameters.get('epochs_run', '?')} epochs of one cycle in place of 200); "
                               f"{text}")


def _dense_multiplications(model: Any) -> int:
    """Multiply-accumulates of the float network without pruning."""
    total = 0
    for layer in model.float_layers:
        if layer.weights.size:
            rows, columns, channels = layer.output_shape
            total += int(np.prod(layer.weights.shape)) * (rows * columns if layer.kind == CONV else 1)
    return total
