"""Float weights to the int8 network (section 5.3), with scales as TensorFlow Lite chooses them."""

import numpy as np

from airtouch.detector.paper.graph import GRAPH, INPUT_SHAPE, OPERATIONS
from airtouch.detector.paper.network import KERNEL_SHAPES, WEIGHTED, Weights
from airtouch.detector.shared.tensorflow import convert, read_weighted_layers
from airtouch.reference.networks.int8_network import Int8Layer, Int8Network

REPRESENTATIVE = 500  #: windows that set the range of each activation


def quantise_network(weights: Weights, windows: np.ndarray) -> tuple[Int8Network, bytes]:
    """The int8 network and the TFLite file of it.

    weights: float32 (`network.weight_shapes`). windows: (n, 100, 3) normalised; REPRESENTATIVE
    of them, evenly spaced, set the activations' ranges. Weights are symmetric, one scale per
    output channel. The network and the file compute the same bits. Needs TensorFlow.
    """
    chosen = windows[np.linspace(0, len(windows) - 1, min(REPRESENTATIVE, len(windows))).astype(int)]
    content = _tflite(weights, chosen.astype(np.float32).reshape(-1, 1, *INPUT_SHAPE))
    return read_tflite(content), content


def _tflite(weights: Weights, windows: np.ndarray) -> bytes:
    """The int8 TFLite file of a network, with scales from the windows (n, rows, columns)."""
    import tensorflow as tf

    def network(x):
        for layer in GRAPH:
            kernel, bias = weights.get(f"{layer.name}.kernel"), weights.get(f"{layer.name}.bias")
            x = OPERATIONS[layer.operation].window(layer, kernel, bias, x)
            x = tf.nn.relu(x) if layer.relu else x
        return x

    return convert(network, (1, *INPUT_SHAPE), windows)


def read_tflite(content: bytes) -> Int8Network:
    """The paper's int8 network out of a TFLite file that `quantise_network` made."""
    layers = read_weighted_layers(content)
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
    for layer in GRAPH:
        shapes = (layer.operation, layer.input_shape, layer.output_shape, layer.kernel)
        scale, zero_point = float(arrays["scale"][at]), int(arrays["zero_point"][at])
        if not layer.kernel_shape:
            layers.append(Int8Layer(*shapes, scale, zero_point, scale, zero_point))
            continue
        at += 1
        layers.append(Int8Layer(*shapes, scale, zero_point, float(arrays["scale"][at]), int(arrays["zero_point"][at]),
                                layer.relu, arrays[f"{layer.name}.weights"], arrays[f"{layer.name}.bias"],
                                arrays[f"{layer.name}.weight_scale"]))
    return Int8Network(tuple(layers))


def arrays_of_network(network: Int8Network) -> dict[str, np.ndarray]:
    """The inverse of `network_of_arrays`."""
    weighted = [layer for layer in network.layers if layer.weighted]
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
