"""A model of `best` as C sources for `gap8/kernels/stream_int8.h` and `firmware/kernels/stream_detector.h`."""

import numpy as np

from airtouch.detector.best.model import BestModel
from airtouch.detector.best.outputs import OUTPUTS
from airtouch.detector.shared.c_source import CONST, CONST_DEFAULT, float_literal, golden_header, golden_source, layer
from airtouch.detector.shared.vehicle_header import name_of, thrust_text
from airtouch.errors import AirTouchError
from airtouch.kernels.network import parameter_bytes
from airtouch.kernels.stream import arena_bytes
from airtouch.reference.motion_channels import MotionConfig
from airtouch.reference.networks.int8_network import quantise
from airtouch.reference.networks.stream_int8 import StreamNetwork, run_stream

GOLDEN = 700  #: samples of the golden flight, more than the network looks back
COMPARED = 20  #: windows of a comparison with tflite-micro
PREFIX = "AIRTOUCH_STREAM_GOLDEN"


def render(model: BestModel) -> dict[str, str]:
    """File name -> text, without the lines that say where it came from."""
    inputs, outputs = golden_flight(model.int8)
    names = ("airtouchStreamGoldenInputs", "airtouchStreamGoldenOutputs")
    what = "Made-up quantised samples and the rows that every build must give, to the last bit."
    return {
        "airtouch_stream.h": _header(model),
        "airtouch_stream.c": _source(model),
        "airtouch_stream_golden.h": golden_header(what, PREFIX, names, inputs, outputs),
        "airtouch_stream_golden.c": golden_source("airtouch_stream_golden.h", names, inputs, outputs),
    }


def golden_flight(network: StreamNetwork, samples: int = GOLDEN) -> tuple[np.ndarray, np.ndarray]:
    """int8 samples (samples, channels) of made-up smooth channels and NumPy's rows (samples / stride, outputs)."""
    walk = np.random.default_rng(0).normal(scale=0.3, size=(samples, network.channels)).cumsum(axis=0)
    first = network.layers[0]
    inputs = quantise(4.0 * np.sin(walk), first.input_scale, first.input_zero_point)
    return inputs, run_stream(network, inputs)


def rows_of_tflite_micro(model: BestModel, quantised: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """tflite-micro's int8 outputs (rows, outputs) over the windows of int8 samples (n, channels) that end at the rows.

    Raises ImportError where tflite-micro is not installed.
    """
    from tflite_micro import runtime

    length, outputs = model.int8.receptive_samples, []
    arena = 2**20 + 4 * length * max(layer.outputs for layer in model.int8.graph)
    interpreter = runtime.Interpreter.from_bytes(model.tflite, arena_size=arena)
    for end in rows * model.int8.stride + 1:
        interpreter.set_input(quantised[end - length:end].reshape(1, 1, length, -1), 0)
        interpreter.invoke()
        outputs.append(interpreter.get_output(0).ravel())
    return np.array(outputs)


def check_against_tflite_micro(model: BestModel) -> int:
    """On how many windows of made-up samples tflite-micro gives the network's bits; 0 where it is not installed.

    Raises AirTouchError where one differs.
    """
    quantised, expected = golden_flight(model.int8, model.int8.receptive_samples + GOLDEN)
    rows = np.linspace(-(-model.int8.receptive_samples // model.int8.stride), len(expected) - 1, COMPARED).astype(int)
    try:
        outputs = rows_of_tflite_micro(model, quantised, rows)
    except ImportError:
        return 0
    wrong = int((outputs != expected[rows]).any(axis=1).sum())
    if wrong:
        raise AirTouchError(f"the int8 network and tflite-micro differ on {wrong} of {len(rows)} windows: an operation "
                            "of the network is not the same in both")
    return len(rows)


def _header(model: BestModel) -> str:
    """airtouch_stream.h: sizes, hash and declarations."""
    network, motion, decoder = model.int8, model.recipe.motion, model.decoder
    names = ", ".join(output.name for output in OUTPUTS)
    return f"""// The `best` detector: {parameter_bytes(network)} bytes of constants.
// Input: {network.channels} motion channels a sample (motion_channels.h), quantised by airtouchStreamQuantisation.
// Output: logits on one sample in {network.stride}: {names} (edge_decoder.h).
#pragma once

#include "kernel_types.h"
#include "stream_int8.h"

#define AIRTOUCH_STREAM_SHA256 "{model.digest}"
#define AIRTOUCH_STREAM_ARENA_BYTES {arena_bytes(network)}  // what streamInt8ArenaBytes says
#define AIRTOUCH_STREAM_VEHICLE "{name_of(motion.vehicle)}"  // it was trained for
#define AIRTOUCH_STREAM_THRUST "{thrust_text(motion.vehicle, motion.arm_pwm)}"
#define AIRTOUCH_STREAM_ENTRY_SCORE {float_literal(decoder.entry_score)}  // airtouchStreamDecoder.entryScore
#define AIRTOUCH_STREAM_EXIT_SCORE {float_literal(decoder.exit_score)}

extern const streamInt8_t airtouchStream;
extern const streamQuantisation_t airtouchStreamQuantisation;
extern const decoderConfig_t airtouchStreamDecoder;
extern const motionConfig_t airtouchStreamMotion;
"""


def _source(model: BestModel) -> str:
    """airtouch_stream.c: weights, network, scales and the settings of decoder and channels."""
    network, decoder = model.int8, model.decoder
    arrays, convs = [], []
    for i, (of, int8) in enumerate(zip(network.graph[:-1], network.layers[:-1], strict=True)):
        text, inside = layer(f"conv{i}", int8)
        arrays.append(text)
        convs.append(f"    {{.dilation = {of.dilation}, .zeroPoint = {int8.input_zero_point}, .layer =\n"
                     f"     {inside}}},")
    text, head = layer("head", network.head)
    first = network.layers[0]
    settings = {
        "overShare": float_literal(decoder.over_share), "entryScore": "AIRTOUCH_STREAM_ENTRY_SCORE",
        "exitScore": "AIRTOUCH_STREAM_EXIT_SCORE", "lateEntry": float_literal(decoder.late_entry),
        "lateExit": float_literal(decoder.late_exit), "smoothGain": float_literal(decoder.smooth_gain)}
    counts = {"dwellSteps": decoder.dwell_steps, "armSteps": decoder.arm_steps, "lookBack": decoder.look_back,
              "holdSteps": decoder.hold_steps}
    return "\n".join([
        '#include "airtouch_stream.h"', "", CONST_DEFAULT, *arrays, text,
        f"static {CONST} streamConv_t convs[] = {{", *convs, "};", "",
        f"static {CONST} layerInt8_t head =\n    {head};", "",
        f"{CONST} streamInt8_t airtouchStream = {{", "    .convs = convs,",
        f"    .convCount = {len(network.layers) - 1},",
        f"    .stride = {network.stride},", f"    .firstSkip = {network.graph[-1].reads[0]},",
        "    .head = &head,", "};", "",
        f"{CONST} streamQuantisation_t airtouchStreamQuantisation = {{",
        f"    .inputScale = {float_literal(first.input_scale)},",
        f"    .outputScale = {float_literal(network.head.output_scale)},",
        f"    .inputZeroPoint = {first.input_zero_point},",
        f"    .outputZeroPoint = {network.head.output_zero_point},", "};", "",
        f"{CONST} decoderConfig_t airtouchStreamDecoder = {{",
        *(f"    .{name} = {value}," for name, value in settings.items()),
        *(f"    .{name} = {value}," for name, value in counts.items()), "};", "", _motion(model.recipe.motion)])


def _motion(motion: MotionConfig) -> str:
    """The settings of the motion channels as a C initialiser."""
    vehicle = motion.vehicle
    thrust = ", ".join(float_literal(c) for c in vehicle.thrust_of_pwm_n)
    literals = [float_literal(1.0 / s) for s in motion.scale]
    scales = ",\n                     ".join(", ".join(literals[i:i + 5]) for i in range(0, len(literals), 5))
    plain = {"limit": motion.limit, "armPwm": motion.arm_pwm, "slowGain": 1.0 / motion.slow_samples,
             "lagGain": 1.0 / motion.lag_samples, "leastThrust": motion.least_thrust_n}
    return "\n".join([
        f"{CONST} motionConfig_t airtouchStreamMotion = {{",
        f"    .vehicle = {{.mass = {float_literal(vehicle.mass_kg)}, .gravity = {float_literal(vehicle.gravity_mps2)},",
        f"                .thrust = {{{thrust}}},",
        f"                .nominalVoltage = {float_literal(vehicle.nominal_voltage_v or 0.0)}}},",
        f"    .inverseScale = {{{scales}}},",
        *(f"    .{name} = {float_literal(value)}," for name, value in plain.items()),
        f"    .settleSamples = {motion.settle_samples},", "};", ""])

