"""Sizes, speed and accuracy after pruning and int8 (section 7.6)."""

import time
from typing import Any

import numpy as np

from airtouch.detector import paper
from airtouch.detector.evaluation import summary
from airtouch.detector.evaluation.score import FlightScore
from airtouch.detector.paper.recipe import SPARSITY
from airtouch.kernels.network import infer_float, infer_int8, parameter_bytes
from airtouch.paper_figures import pictures, recorded, words
from airtouch.paper_figures.claims import CLAIMS, UNTESTABLE
from airtouch.paper_figures.figure import Figure, Job, Missing, Verdict

FLOAT_BYTES = 4
#: balanced accuracy that the float network must exceed: that of the paper's larger network (section 7.6, line 622)
LEAST_ACCURACY = 0.92
LEAST_LOSS = 0.05  #: of it that pruning and int8 must cost; no source: about half of the paper's 97 - 86 %


def sizes(job: Job) -> Figure:
    """Section 7.6: the paper's network in float and int8, unpruned and with the shipped sparsity of its dense layer."""
    model = paper.load(None)
    weights = sum(int(np.size(w)) for w in model.weights.values())
    times = _milliseconds(model)
    rows: list[dict[str, Any]] = [
        {"what": "paper's network, float", "bytes": FLOAT_BYTES * weights, "ms_here": times["float"]},
        {"what": "shipped: 80 % zeros, int8", "bytes": parameter_bytes(model.int8), "ms_here": times["int8"]}]
    try:
        accuracy = _accuracies(job, rows)
    except Missing as missing:
        accuracy = Verdict(UNTESTABLE, str(missing))
    before, after = CLAIMS["size"].values
    ours = rows[1]["bytes"]
    verdicts = {
        "size": words.verdict(words.near(FLOAT_BYTES * weights, before) and ours <= after,
                              f"{FLOAT_BYTES * weights:,} bytes in float ({weights:,} weights and biases), {ours:,} "
                              f"bytes shipped, {FLOAT_BYTES * weights / ours:.1f} times less"),
        "speed": Verdict(UNTESTABLE, f"no GAP8 here; on this machine float {times['float']:.3f} ms and int8 "
                         f"{times['int8']:.3f} ms a window ({times['float'] / times['int8']:.1f} times), plain C, one "
                         "thread"),
        "accuracy": accuracy}
    caption = ("Bytes are what the drone carries: weights, biases and scales; where zeros are left out, with their "
               "places. Accuracy is balanced over windows of recorded flights held out by flight; the paper's is of "
               "windows drawn at random, which share samples with those trained on.")
    return Figure("Sizes and accuracy after pruning and int8", rows, caption, verdicts,
                  lambda canvas: _draw(canvas, rows))


def _accuracy_falls(exact: list[FlightScore], int8: list[FlightScore]) -> bool | None:
    """Whether int8 with zeros loses as the paper's network did: more than LEAST_LOSS from over LEAST_ACCURACY.

    By the 95 % intervals of both, over the same flights; None for undecided.
    """
    intervals = summary.paired(exact, int8, lambda first, second: {
        "exact": first["balanced_accuracy"], "loss": first["balanced_accuracy"] - second["balanced_accuracy"]})
    answers = []
    for name, least in (("exact", LEAST_ACCURACY), ("loss", LEAST_LOSS)):
        low, high = intervals[name] or (np.nan, np.nan)
        answers.append(words.decided(low > least, high <= least))
    return words.all_of(answers)


def _draw(canvas: Any, rows: list[dict[str, Any]]) -> None:
    """Draw bytes, and balanced accuracy against the share of zeros."""
    left, right = canvas.subplots(1, 2)
    left.barh([r["what"] for r in rows], [r["bytes"] / 1000 for r in rows], color=pictures.COLOURS["paper"])
    for value in CLAIMS["size"].values:
        left.axvline(value / 1000, color=pictures.PAPER, ls="--", lw=1)
    left.set(xlabel="parameters, kB (dashed: the paper's)")
    left.tick_params(axis="y", labelsize=7)
    trained = [r for r in rows if r.get("balanced_int8") is not None and r.get("balanced_float") is not None]
    for key, marker in (("balanced_float", "o"), ("balanced_int8", "s")):
        right.plot([100 * r["zeros"] for r in trained], [100 * r[key] for r in trained], marker + "-", ms=4,
                   label=key.removeprefix("balanced_"), color=pictures.COLOURS["paper"],
                   alpha=1.0 if marker == "s" else 0.5)
    for value in CLAIMS["accuracy"].values:
        right.axhline(100 * value, color=pictures.PAPER, ls="--", lw=1)
    right.set(xlabel="zeros in the first dense layer, %", ylabel="window accuracy, % (dashed: the paper's)",
              ylim=(45, 100))
    if trained:
        right.legend(fontsize=7, frameon=False)


def _milliseconds(model: Any) -> dict[str, float]:
    """Milliseconds per window of the float and the int8 network in C on this computer; the least of three runs."""
    windows = np.random.default_rng(0).normal(size=(200, 100, 3)).astype(np.float32)
    milliseconds = {}
    for name, call in (("float", lambda: infer_float(model.float_layers, windows)),
                       ("int8", lambda: infer_int8(model, windows))):
        spent = []
        for _ in range(3):
            started = time.perf_counter()
            call()
            spent.append(time.perf_counter() - started)
        milliseconds[name] = 1e3 * min(spent) / len(windows)
    return milliseconds


def _accuracies(job: Job, rows: list[dict[str, Any]]) -> Verdict:
    """Add a row for each sparsity, with float and int8 accuracy on held-out flights. Verdict on the last."""
    epochs = {"epochs": 3} if job.quick else {}
    texts = []
    for zeros, options in ((0.0, {"sparsity": 0.0}), (SPARSITY, {})):
        scores, folds = recorded.variant_scores(job, "paper", None, {**epochs, **options})
        exact = recorded.in_float(job, "paper", folds)
        row, float_row = summary.summarise(scores), summary.summarise(exact)
        rows.append({"what": f"{100 * zeros:.0f} % zeros, int8", "bytes": folds[0].parameters["parameter_bytes"],
                     "zeros": zeros, "balanced_float": float_row["balanced_accuracy"],
                     "balanced_int8": row["balanced_accuracy"], "flights": row["flights"]})
        texts.append(f"{100 * zeros:.0f} % zeros: float {words.percent(float_row['balanced_accuracy'])}, int8 "
                    f"{words.percent(row['balanced_accuracy'], row['intervals']['balanced_accuracy'])}")
    return words.verdict(_accuracy_falls(exact, scores),
                         f"balanced, by flight, n = {rows[-1]['flights']} flights: " + "; ".join(texts))
