"""Float weights to the int8 network (section 5.3), with scales as TensorFlow Lite chooses them."""

import contextlib
import os
import warnings
from collections.abc import Callable, Iterator

import numpy as np

from airtouch.detector.network import GRAPH, INPUT_SHAPE, KERNEL_SHAPES, WEIGHTED, Weights
from airtouch.reference.int8_network import Int8Layer, Int8Network

REPRESENTATIVE = 500  #: windows that set the range of each activation


def quantise(weights: Weights, windows: np.ndarray) -> tuple[Int8Network, bytes]:
    """The int8 network and the TFLite file of it.

    weights: float32 (`network.weight_shapes`). windows: (n, 100, 3) normalised; REPRESENTATIVE
    of them, evenly spaced, set the activations' ranges. Weights are symmetric, one scale per
    output channel. The network and the file compute the same bits. Needs TensorFlow.
    """
    chosen = windows[np.linspace(0, len(windows) - 1, min(REPRESENTATIVE, len(windows))).astype(int)]
    content = _tflite(weights, chosen.astype(np.float32).reshape(-1, 1, *INPUT_SHAPE))
    return read_tflite(content), content


def _tflite(weights: Weights, windows: np.ndarray) -> bytes:
    import tensorflow as tf

    def network(x):
        for kind, name, _, _, kernel, relu in GRAPH:
            if kind == "max_pool":
                x = tf.nn.max_pool2d(x, kernel, kernel, "VALID")
                continue
            values, bias = weights[f"{name}.kernel"], weights[f"{name}.bias"]
            if kind == "conv":
                x = tf.nn.conv2d(x, values, 1, "VALID") + bias
            else:
                x = tf.matmul(tf.reshape(x, (1, values.shape[0])), values) + bias
            x = tf.nn.relu(x) if relu else x
        return x

    return convert(network, (1, *INPUT_SHAPE), windows)


def convert(network: Callable, shape: tuple[int, ...], inputs: np.ndarray) -> bytes:
    """A TFLite file, int8 throughout, of a function of one tensor of this shape.

    inputs: (n, *shape) float32 that set the activations' ranges. Needs TensorFlow.
    """
    import tensorflow as tf

    function = tf.function(network, input_signature=[tf.TensorSpec(shape, tf.float32)])
    with _quiet():
        converter = tf.lite.TFLiteConverter.from_concrete_functions([function.get_concrete_function()])
        converter.optimizations = [tf.lite.Optimize.DEFAULT]
        converter.representative_dataset = lambda: ([x] for x in inputs)
        converter.target_spec.supported_ops = [tf.lite.OpsSet.TFLITE_BUILTINS_INT8]
        converter.inference_input_type = tf.int8
        converter.inference_output_type = tf.int8
        return bytes(converter.convert())


def read_weighted(content: bytes) -> list[dict[str, np.ndarray]]:
    """The layers with weights of a TFLite file that `convert` made, in order.

    Each: weights int8 (out, ...), bias int32 (out,), weight_scale float32 (out,), and scale float32 and
    zero_point int32 of input and output, (2,).
    """
    from tensorflow.lite.python import schema_py_generated as schema

    model = schema.ModelT.InitFromObj(schema.Model.GetRootAs(content, 0))
    graph = model.subgraphs[0]
    layers = []
    weighted = (schema.BuiltinOperator.CONV_2D, schema.BuiltinOperator.FULLY_CONNECTED)
    for op in graph.operators:
        if model.operatorCodes[op.opcodeIndex].builtinCode not in weighted:
            continue
        tensors = [graph.tensors[i] for i in (*op.inputs, op.outputs[0])]
        kernel, bias = tensors[1], model.buffers[tensors[2].buffer].data
        around = [tensors[0].quantization, tensors[3].quantization]
        values = np.array(model.buffers[kernel.buffer].data, dtype=np.uint8).view(np.int8)
        layers.append({
            "weights": values.reshape(kernel.shape),
            "bias": np.frombuffer(bytes(bias), dtype="<i4").copy(),
            "weight_scale": np.broadcast_to(np.asarray(kernel.quantization.scale, dtype=np.float32),
                                            (len(bias) // 4,)).copy(),
            "scale": np.array([q.scale[0] for q in around], dtype=np.float32),
            "zero_point": np.array([q.zeroPoint[0] for q in around], dtype=np.int32),
        })
    return layers


def read_tflite(content: bytes) -> Int8Network:
    """The paper's int8 network out of a TFLite file that `quantise` made."""
    layers = read_weighted(content)
    arrays: dict[str, np.ndarray] = {}
    for name, layer in zip(WEIGHTED, layers, strict=True):
        for part in ("weights", "bias", "weight_scale"):
            arrays[f"{name}.{part}"] = layer[part]
    for part in ("scale", "zero_point"):
        arrays[part] = np.array([layers[0][part][0], *(layer[part][1] for layer in layers)])
    return network_of_arrays(arrays)


def network_of_arrays(arrays: dict[str, np.ndarray]) -> Int8Network:
    """The int8 network from the arrays of `int8_shapes`; activations are input, then each weighted layer."""
    layers = []
    at = 0  # which activation the layer reads
    for kind, name, before, after, kernel, relu in GRAPH:
        scale, zero_point = float(arrays["scale"][at]), int(arrays["zero_point"][at])
        if name is None:
            layers.append(Int8Layer(kind, before, after, kernel, scale, zero_point, scale, zero_point))
            continue
        at += 1
        layers.append(Int8Layer(kind, before, after, kernel, scale, zero_point,
                                float(arrays["scale"][at]), int(arrays["zero_point"][at]), relu,
                                arrays[f"{name}.weights"], arrays[f"{name}.bias"],
                                arrays[f"{name}.weight_scale"]))
    return Int8Network(tuple(layers))


def arrays_of_network(network: Int8Network) -> dict[str, np.ndarray]:
    """The inverse of `network_of_arrays`."""
    weighted = [layer for layer in network.layers if layer.kind != "max_pool"]
    arrays = {}
    for name, layer in zip(WEIGHTED, weighted, strict=True):
        arrays[f"{name}.weights"], arrays[f"{name}.bias"] = layer.weights, layer.bias
        arrays[f"{name}.weight_scale"] = layer.weight_scale
    first = weighted[0]
    arrays["scale"] = np.array([first.input_scale] + [la.output_scale for la in weighted], dtype=np.float32)
    zero_points = [first.input_zero_point] + [la.output_zero_point for la in weighted]
    arrays["zero_point"] = np.array(zero_points, dtype=np.int32)
    return arrays


def int8_shapes() -> dict[str, tuple[type, tuple[int, ...]]]:
    """dtype and shape of each array of `network_of_arrays`."""
    shapes: dict[str, tuple[type, tuple[int, ...]]] = {}
    for name, shape in KERNEL_SHAPES.items():
        shapes[f"{name}.weights"] = (np.int8, (shape[-1], *shape[:-1]))
        shapes[f"{name}.bias"] = (np.int32, shape[-1:])
        shapes[f"{name}.weight_scale"] = (np.float32, shape[-1:])
    activations = (len(KERNEL_SHAPES) + 1,)
    return {**shapes, "scale": (np.float32, activations), "zero_point": (np.int32, activations)}


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """The converter writes its progress to the process's standard error; not here."""
    saved, null = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 2)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        os.dup2(saved, 2)
        os.close(saved)
        os.close(null)
