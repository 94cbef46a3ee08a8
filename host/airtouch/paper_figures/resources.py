"""Table 2: operations, parameters, training time and memory of AirTouch and of the camera."""

from typing import Any

import numpy as np

from airtouch.detector import best, paper
from airtouch.kernels.network import parameter_bytes
from airtouch.paper_figures import pictures, recorded, words
from airtouch.paper_figures.claims import CLAIMS, REPRODUCED, UNTESTABLE
from airtouch.paper_figures.figure import Figure, Job, Missing, Verdict
from airtouch.parameters import DEFAULT
from airtouch.reference.networks.int8_network import CONV, multiplications
from airtouch.vision import teed, weights
from airtouch.vision.camera import Camera

PAPER_CAMERA = (320, 320)  #: rows and columns that the paper states for its camera
FLOPS_A_MAC = 2


def resources(job: Job) -> Figure:
    """Table 2: the paper's network, `best` and a network with TEED's structure, counted from their shapes."""
    ours, stream = paper.load(None), best.load(None)
    count = sum(int(np.size(w)) for w in ours.weights.values())
    mac = multiplications(ours.int8)
    dense_mac = _dense_multiplications(ours)
    vision_mac = teed.multiplications(*PAPER_CAMERA, colours=3)
    parameters = teed.parameters(colours=3)
    camera, vision_seconds = Camera(), weights.load("teed")[1]
    window_bits = 32 * 3 * DEFAULT.feature_window
    ring_bits = 32 * 9 * DEFAULT.band_window
    frame_bits = 8 * camera.width * camera.height
    own = best.parameters(stream)
    rows: list[dict[str, Any]] = [
        {"what": "TEED's structure, 320 x 320", "mac": vision_mac, "flops": FLOPS_A_MAC * vision_mac,
         "parameters": parameters, "parameter_bytes": 4 * parameters, "training_s": vision_seconds,
         "frame_bits": 8 * PAPER_CAMERA[0] * PAPER_CAMERA[1]},
        {"what": "paper's network, no zeros", "mac": dense_mac, "flops": FLOPS_A_MAC * dense_mac, "parameters": count,
         "parameter_bytes": 4 * count, "frame_bits": window_bits},
        {"what": "paper's network as shipped", "mac": mac, "flops": FLOPS_A_MAC * mac, "parameters": count,
         "parameter_bytes": parameter_bytes(ours.int8), "frame_bits": window_bits},
        {"what": "best, a step of 10 ms", "mac": own["mac_per_sample"], "flops": FLOPS_A_MAC * own["mac_per_sample"],
         "parameter_bytes": own["parameter_bytes"], "frame_bits": 8 * own["state_bytes"]}]
    theirs_flops, said_flops = CLAIMS["flops"].values
    pixels = theirs_flops / FLOPS_A_MAC / (vision_mac / np.prod(PAPER_CAMERA))
    verdicts = {
        "flops": words.judged(_near(dense_mac, said_flops) and _near(FLOPS_A_MAC * vision_mac, theirs_flops),
                              f"paper's network {dense_mac / 1e6:.2f} million multiply-accumulates without zeros (the "
                              f"paper's 0.28 counts these), {mac / 1e6:.2f} as shipped; TEED at 320 x 320 "
                              f"{FLOPS_A_MAC * vision_mac / 1e6:,.0f} million FLOPs, {vision_mac / 1e6:,.0f} million "
                              "multiply-accumulates; 3900 million FLOPs are those of an image of "
                              f"{np.sqrt(pixels):.0f} x {np.sqrt(pixels):.0f}. 0.28 of 3900 is 0.007 %, as the text "
                              "says, not the table's 0.07 %"),
        "parameters": words.judged(parameter_bytes(ours.int8) <= CLAIMS["parameters"].values[1]
                                   and _near(parameters, CLAIMS["parameters"].values[0]),
                                   f"{parameter_bytes(ours.int8):,} bytes as shipped; TEED has {parameters:,} weights "
                                   f"and biases: 58 kB at one byte each, {4 * parameters:,} bytes in float"),
        "training": _training(job, rows, vision_seconds),
        "memory": words.judged(window_bits <= CLAIMS["memory"].values[0] and frame_bits > 20 * window_bits,
                               f"a window of features {window_bits:,} bits, {ring_bits:,} with the samples of its "
                               f"band power; a frame of 324 x 244 {frame_bits:,} bits, of 320 x 320 "
                               f"{8 * PAPER_CAMERA[0] * PAPER_CAMERA[1]:,}: less than a million, not millions")}

    def draw(canvas):
        for axes, key, label in zip(canvas.subplots(1, 3), ("mac", "parameter_bytes", "frame_bits"),
                                    ("multiply-accumulates", "bytes of parameters", "bits a frame or window"),
                                    strict=True):
            axes.bar(range(len(rows)), [r[key] for r in rows],
                     color=[pictures.MUTED, pictures.COLOURS["paper"], pictures.COLOURS["paper"],
                            pictures.COLOURS["best"]])
            axes.set_yscale("log")
            axes.set_xticks(range(len(rows)), ["vision", "paper,\nno zeros", "paper", "best"], fontsize=7)
            axes.set_title(label)

    caption = ("Counted from the networks' shapes, not measured. The vision network is written anew with TEED's "
               "structure; three colours as published. Training is of one model, processor time here and the paper's "
               "own minutes elsewhere: its machine is not named.")
    return Figure("Resources", rows, caption, verdicts, draw)


def _training(job: Job, rows: list[dict[str, Any]], vision_seconds: float) -> Verdict:
    """Verdict on training time: a fold of the paper's network in this run against the vision network."""
    text = f"vision network {vision_seconds / 60:.1f} min of processor time on rendered images"
    try:
        _, folds = recorded.scores(job, "paper")
    except Missing:
        return Verdict(UNTESTABLE, f"{text}; {Missing('no recorded flights here to train the paper’s network on')}")
    timed = [f["cpu_seconds"] for f in folds if "cpu_seconds" in f] or [f["seconds"] for f in folds]
    seconds = float(np.mean(timed))
    rows[1]["training_s"] = seconds
    verdict = REPRODUCED if seconds < CLAIMS["training"].values[1] else UNTESTABLE
    return Verdict(verdict, f"paper's network {seconds / 60:.1f} min of processor time a fold here (n = {len(timed)}, "
                            "choice of thresholds and scoring included, "
                            f"{folds[0]['parameters'].get('epochs_run', '?')} epochs of one cycle in place of 200); "
                            f"{text}")


def _dense_multiplications(model: Any) -> int:
    """Multiply-accumulates of the float network without pruning."""
    total = 0
    for layer in model.float_layers:
        if layer.weights.size:
            rows, columns, channels = layer.output_shape
            total += int(np.prod(layer.weights.shape)) * (rows * columns if layer.kind == CONV else 1)
    return total


def _near(value: float, published: float, share: float = 0.1) -> bool:
    return abs(value - published) <= share * published
