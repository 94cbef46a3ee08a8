"""A network of the paper's as C sources: whole windows (`paper`) and rolling over samples (`paper-stream`)."""

import numpy as np

from airtouch.detector.paper import decoding_settings, stride
from airtouch.detector.paper.model import Model
from airtouch.detector.paper.network import WEIGHTED
from airtouch.detector.shared.c_source import CONST, CONST_DEFAULT, float_literal, golden_header, golden_source, layer
from airtouch.errors import AirTouchError
from airtouch.kernels.network import arena_bytes, parameter_bytes
from airtouch.kernels.rolling import rolling_size
from airtouch.parameters import DEFAULT
from airtouch.reference import z_score_window
from airtouch.reference.networks.int8_network import Int8Network, quantise, run

GOLDEN = 16  #: number of golden windows
GOLDEN_SAMPLES = 300  #: samples of the golden flight of a rolling network, three windows
_GOLDEN_NAMES = ("airtouchGoldenInputs", "airtouchGoldenOutputs")
_ROLLING_GOLDEN = ("airtouchRollingGoldenInputs", "airtouchRollingGoldenOutputs")


def render(model: Model) -> dict[str, str]:
    """File name -> C text, without the header lines on its origin."""
    return _render_rolling(model) if model.scale else _render_window(model)


def _render_window(model: Model) -> dict[str, str]:
    """File name -> text, for a model of z-scored windows."""
    inputs, outputs = golden_vectors(model.int8)
    what = "Made-up quantised windows and the outputs that every build must give, to the last bit."
    return {
        "airtouch_model.h": _model_header(model),
        "airtouch_model.c": _model_source(model.int8, "airtouch_model.h", "airtouchNetwork"),
        "airtouch_golden.h": golden_header(what, "AIRTOUCH_GOLDEN", _GOLDEN_NAMES, inputs, outputs),
        "airtouch_golden.c": golden_source("airtouch_golden.h", _GOLDEN_NAMES, inputs, outputs),
    }


def _render_rolling(model: Model) -> dict[str, str]:
    """File name -> text, for a model on a fixed scale."""
    inputs, outputs = golden_samples(model.int8, stride(model))
    if model.scale is None:
        raise AirTouchError("this model is one of windows: it has no fixed scale to roll on")
    what = "Made-up quantised samples and the outputs that every build must give, to the last bit."
    scale = "\n".join([
        f"{CONST} fixedScale_t airtouchRollingScale = {{", f"    .columns = {len(model.scale.mean)},",
        f"    .mean = {{{', '.join(map(float_literal, model.scale.mean))}}},",
        f"    .inverseDeviation = {{{', '.join(map(float_literal, 1.0 / model.scale.deviation.astype(float)))}}},",
        "};", ""])
    return {
        "airtouch_rolling.h": _rolling_header(model),
        "airtouch_rolling.c": _model_source(model.int8, "airtouch_rolling.h", "airtouchRolling") + "\n" + scale,
        "airtouch_rolling_golden.h": golden_header(what, "AIRTOUCH_ROLLING_GOLDEN", _ROLLING_GOLDEN, inputs, outputs),
        "airtouch_rolling_golden.c": golden_source("airtouch_rolling_golden.h", _ROLLING_GOLDEN, inputs, outputs),
    }


def golden_vectors(network: Int8Network) -> tuple[np.ndarray, np.ndarray]:
    """int8 inputs (GOLDEN, inputs), random smooth windows, and their outputs (GOLDEN, outputs) by NumPy."""
    rows, columns, channels = network.input_shape
    walk = np.random.default_rng(0).normal(size=(GOLDEN, rows, columns * channels)).cumsum(axis=1)
    first = network.layers[0]
    inputs = quantise(z_score_window(walk), first.input_scale, first.input_zero_point).reshape(GOLDEN, -1)
    return inputs, run(network, inputs)


def golden_samples(network: Int8Network, stride: int) -> tuple[np.ndarray, np.ndarray]:
    """int8 samples (GOLDEN_SAMPLES, columns) of a random smooth flight; outputs of its whole windows by NumPy."""
    rows, columns, channels = network.input_shape
    walk = np.random.default_rng(0).normal(scale=0.3, size=(GOLDEN_SAMPLES, columns * channels)).cumsum(axis=0)
    first, size = network.layers[0], rolling_size(network, stride)
    inputs = quantise(4.0 * np.sin(walk), first.input_scale, first.input_zero_point)
    answered = np.arange(stride - 1, GOLDEN_SAMPLES - size.ahead, stride)
    ends = answered[answered >= rows - 1 - size.ahead] + size.ahead
    return inputs, run(network, np.stack([inputs[end - rows + 1:end + 1] for end in ends]))


def _rolling_header(model: Model) -> str:
    """airtouch_rolling.h: sizes, hash and declarations."""
    network, step = model.int8, stride(model)
    size = rolling_size(network, step)
    (rows, columns, channels), outputs = network.input_shape, network.outputs
    return f"""// The `paper-stream` detector: {parameter_bytes(network)} bytes of constants.
// Input: {columns * channels} fused features a sample, on airtouchRollingScale (fixedScaleApply), then quantised:
// networkInt8Quantise. rollingInt8Init at stride AIRTOUCH_ROLLING_STRIDE, then rollingInt8Step: {outputs} logits
// on one sample in {step}, {size.ahead} samples before the window is full. The same network runs over whole windows.
#pragma once

#include "fixed_scale.h"
#include "rolling_int8.h"

#define AIRTOUCH_ROLLING_SHA256 "{model.digest}"
#define AIRTOUCH_ROLLING_ROWS {rows}
#define AIRTOUCH_ROLLING_COLUMNS {columns * channels}
#define AIRTOUCH_ROLLING_OUTPUTS {outputs}
#define AIRTOUCH_ROLLING_STRIDE {step}
#define AIRTOUCH_ROLLING_ARENA_BYTES {size.arena_bytes}  // what rollingInt8ArenaBytes says

{_decoding(model, "AIRTOUCH_ROLLING")}
extern const networkInt8_t airtouchRolling;
extern const fixedScale_t airtouchRollingScale;
"""


def _model_header(model: Model) -> str:
    """airtouch_model.h: sizes, hash and declarations."""
    network = model.int8
    rows, columns, channels = network.input_shape
    return f"""// The trained network: {parameter_bytes(network)} bytes of constants.
// Input: {rows} x {columns * channels} fused features, normalised ({model.normalisation}), then quantised:
// networkInt8Quantise. Output: {network.outputs} logits; P(over a platform) is the softmax of the last.
#pragma once

#include "network_int8.h"

#define AIRTOUCH_MODEL_SHA256 "{model.digest}"
#define AIRTOUCH_MODEL_ROWS {rows}
#define AIRTOUCH_MODEL_COLUMNS {columns * channels}
#define AIRTOUCH_MODEL_OUTPUTS {network.outputs}
#define AIRTOUCH_MODEL_ARENA_BYTES {arena_bytes(network)}  // what networkInt8ArenaBytes says

{_decoding(model, "AIRTOUCH_MODEL")}
extern const networkInt8_t airtouchNetwork;
"""


def _decoding(model: Model, prefix: str) -> str:
    """C constants that turn the network's outputs into edges, for the processor that does not run the network."""
    settings = decoding_settings(model)[0] if "parameters" in model.metadata else DEFAULT
    return f"""// How its logits become edges, as chosen with it; samples of 10 ms.
#define {prefix}_OUTPUT_SCALE {float_literal(model.int8.layers[-1].output_scale)}  // P is the softmax of the logits
#define {prefix}_PROBABILITY_ENTRY {settings.probability_entry!r}f
#define {prefix}_PROBABILITY_EXIT {settings.probability_exit!r}f
#define {prefix}_DWELL_SAMPLES {settings.dwell_samples}
#define {prefix}_ALERT_HOLD {settings.alert_hold}
"""


def _model_source(network: Int8Network, header: str, variable: str) -> str:
    """The C source of a network with its arrays. variable: its name in C."""
    names = iter(WEIGHTED)
    parts = [layer(next(names) if of.weighted else "", of) for of in network.layers]
    arrays = [text for text, _ in parts if text]
    rows = [f"    {initialiser}," for _, initialiser in parts]
    first, last = network.layers[0], network.layers[-1]
    return "\n".join([
        f'#include "{header}"', "", CONST_DEFAULT, *arrays,
        f"static {CONST} layerInt8_t layers[] = {{", *rows, "};", "",
        f"{CONST} networkInt8_t {variable} = {{", "    .layers = layers,",
        f"    .layerCount = {len(network.layers)},",
        f"    .inputScale = {float_literal(first.input_scale)},", f"    .inputZeroPoint = {first.input_zero_point},",
        f"    .outputScale = {float_literal(last.output_scale)},",
        f"    .outputZeroPoint = {last.output_zero_point},",
        "};", ""])
