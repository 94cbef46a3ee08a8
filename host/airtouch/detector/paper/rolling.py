"""The `paper-stream` detector: the paper's network rolling over samples, on a fixed scale of inputs, pruned harder.

A step computes one row of each layer (`gap8/kernels/rolling_int8.h`).

The paper z-scores each window by itself, so the network computes all of it anew for every sample. On a fixed scale of
the features' logarithm most rows of a window were computed for the windows before, and nine in ten products are
saved; pruning saves most of the rest. The answers equal those of the same network over whole windows, to the last bit.
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

ANSWER_STRIDE = 4  #: samples between two answers: the two pools halve the rows each, so that no row is computed in vain
#: shares of zeros in the first dense layer and in the second convolution: with them a sample takes less than 8,000
#: instructions of a RISC-V core in the mean (host/docs/gap8-network.md)
SPARSITY, CONV_SPARSITY = 0.96, 0.8


def run(log: FlightLog, model: Model | None = None) -> Trace:
    """P(over a platform) and edges of one flight; AirTouchError that names missing columns."""
    return paper.run(log, model or load(None))


def run_float(log: FlightLog, model: Model | None = None) -> Trace:
    """As `run`, with the float network as trained, over the windows of the same answers: quantisation apart."""
    return paper.run_float(log, model or load(None))


def fit(flights: Sequence[FlightLog], seed: int = 0, *, physical_filter: bool = True, stride: int = ANSWER_STRIDE,
        sparsity: float = SPARSITY, conv_sparsity: float = CONV_SPARSITY, **options: Any) -> Model:
    """A model as `paper.fit` trains it, with inputs on a fixed scale and more zeros.

    stride: samples between two answers. sparsity, conv_sparsity: shares of zeros. options: as those of `paper.fit`.
    """
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
    """Numbers by name, as `paper.parameters`, with the cost of a sample instead of a window's."""
    model = model or load(None)
    stride = paper.stride(model)
    return {**paper.parameters(model), "stride": stride, "conv_sparsity": model.metadata.get("conv_sparsity"),
            "state_bytes": rolling_size(model.int8, stride).arena_bytes,
            "mac_per_sample": rolling_multiplications(model.int8, stride)}
