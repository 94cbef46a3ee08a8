"""The `paper-stream` detector: the paper's network rolling over samples, on a fixed scale of inputs, pruned harder.

A step computes one row of each layer (`gap8/kernels/rolling_int8.h`).

The paper z-scores each window by itself, so that every sample computes all of it anew. On a fixed scale of
the features' logarithm a window's answer follows from what was computed before, and nine in ten
products fall away; most of the rest does with pruning. What it answers is, to the last bit, what the same
network gives over windows.
"""

from collections.abc import Sequence
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Any

from airtouch.detector import paper
from airtouch.detector.paper import model as model_file
from airtouch.detector.paper.model import Model
from airtouch.detector.trace import Trace
from airtouch.errors import AirTouchError
from airtouch.kernels.rolling import rolling_size
from airtouch.logs.flight_log import FlightLog
from airtouch.reference.networks.int8_network import rolling_multiplications

STRIDE = 4  #: samples to one answer: what the two pools make together, so that no row is computed in vain
#: zeros of the first dense layer and of the second convolution: a step within 8 k instructions of a RISC-V core
#: (host/docs/gap8-network.md)
SPARSITY, CONV_SPARSITY = 0.96, 0.8


def run(log: FlightLog, model: Model | None = None) -> Trace:
    """P(over a platform) and edges of one flight; AirTouchError that names missing columns."""
    return paper.run(log, model or load(None))


def run_float(log: FlightLog, model: Model) -> Trace:
    """As `run`, with the float network as trained, over windows: what quantisation is measured against."""
    return paper.run_float(log, model)


def fit(flights: Sequence[FlightLog], seed: int = 0, *, physical_filter: bool = True, stride: int = STRIDE,
        sparsity: float = SPARSITY, conv_sparsity: float = CONV_SPARSITY, **options: Any) -> Model:
    """Train, prune and quantise on a fixed scale, then choose decoding and lag as `paper.fit` does."""
    from airtouch.detector.paper.training import train_paper

    model = train_paper(flights, seed=seed, fixed_scale=True, sparsity=sparsity, conv_sparsity=conv_sparsity, **options)
    model = replace(model, metadata={**model.metadata, "detector": "paper-stream", "stride": stride})
    return retune(model, flights, physical_filter)


def retune(model: Model, flights: Sequence[FlightLog], physical_filter: bool = True) -> Model:
    """The same network with decoding and lag chosen again, from the flights it was trained with."""
    return paper.retune(model, flights, physical_filter)


def load(path: Path | None) -> Model:
    """A model from its file, the shipped one for None; AirTouchError for one that cannot roll over samples."""
    if path is None:
        with resources.as_file(resources.files("airtouch") / "models" / "paper_stream.npz") as shipped:
            return load(shipped)
    model = model_file.load(path)
    if model.scale is None:
        raise AirTouchError(f"{path}: its windows are z-scored by themselves, so it cannot run as a stream; "
                            "use --detector paper")
    return model


def lag_s(model: Model | None) -> float:
    """The lag learnt in training, seconds."""
    return paper.lag_s(model or load(None))


def parameters(model: Model | None) -> dict[str, Any]:
    """As `paper.parameters`, with the cost of a sample instead of a window's."""
    model = model or load(None)
    stride = paper.stride(model)
    return {**paper.parameters(model), "stride": stride, "conv_sparsity": model.metadata.get("conv_sparsity"),
            "state_bytes": rolling_size(model.int8, stride).arena_bytes,
            "mac_per_sample": rolling_multiplications(model.int8, stride)}
