"""A small convolutional network for edges with the structure of TEED (Soria et al., ICCV workshops 2023).

Three blocks at a half and a quarter of the resolution, each brought back to full size as one map, and a fusion of the
three by depthwise convolutions. Grey input: 58,622 weights and biases at full width; the published network has three
colours and 288 more. The last activation is left out, since what comes out is a logit.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import expit

if TYPE_CHECKING:
    import keras

WIDTHS = (16, 32, 48)  #: channels of the three blocks, as published
FUSED = 8  #: channels of the fusion for each map
Weights = Mapping[str, np.ndarray]


def layers(widths: tuple[int, int, int] = WIDTHS, colours: int = 1) -> dict[str, tuple[int, ...]]:
    """Name -> kernel shape (rows, columns, in, out); "up..." transposed (rows, columns, out, in), "fuse..." depthwise
    (rows, columns, in, multiplier). Each has a bias of its outputs."""
    a, b, c = widths
    between = min(16, c)
    return {
        "block1.1": (3, 3, colours, a), "block1.2": (3, 3, a, a),
        "block2.1": (3, 3, a, b), "block2.2": (3, 3, b, b),
        "side1": (1, 1, a, b), "pre3": (1, 1, b, c), "block3.1": (3, 3, b, c), "block3.2": (3, 3, c, c),
        "out1": (1, 1, a, 1), "up1": (2, 2, 1, 1), "out2": (1, 1, b, 1), "up2": (2, 2, 1, 1),
        "out3.1": (1, 1, c, between), "up3.1": (4, 4, between, between), "out3.2": (1, 1, between, 1),
        "up3.2": (4, 4, 1, 1), "fuse1": (3, 3, 3, FUSED), "fuse2": (3, 3, 3 * FUSED, 1),
    }


def outputs(name: str, shape: tuple[int, ...]) -> int:
    """Number of output channels of a layer."""
    if name.startswith("up"):
        return shape[2]
    return shape[2] * shape[3] if name.startswith("fuse") else shape[3]


def parameters(widths: tuple[int, int, int] = WIDTHS, colours: int = 1) -> int:
    """Weights and biases."""
    return sum(int(np.prod(s)) + outputs(n, s) for n, s in layers(widths, colours).items())


def multiplications(rows: int, columns: int, widths: tuple[int, int, int] = WIDTHS, colours: int = 1) -> int:
    """Multiply-accumulates of one image."""
    full, half, quarter = rows * columns, rows * columns // 4, rows * columns // 16
    places = {"side1": quarter, "pre3": quarter, "block3.1": quarter, "block3.2": quarter, "out3.1": quarter,
              "up3.1": quarter, "out3.2": half, "up3.2": half, "fuse1": full, "fuse2": full}
    return sum(int(np.prod(s)) * places.get(n, half) for n, s in layers(widths, colours).items())


def smish(x: np.ndarray) -> np.ndarray:
    """x tanh(ln(1 + sigmoid(x))), TEED's activation; tanh(ln y) is (y^2 - 1) / (y^2 + 1)."""
    y = (1.0 + expit(x)) ** 2
    return x * (y - 1.0) / (y + 1.0)


def infer(weights: Weights, image: np.ndarray) -> np.ndarray:
    """P(edge) (rows, columns) of a grey image (rows, columns) of 0 to 255, both multiples of 4. Plain NumPy."""
    x = normalise(image)[..., None]
    one = smish(_conv(weights, "block1.2", smish(_conv(weights, "block1.1", x, 2))))
    two = _conv(weights, "block2.2", smish(_conv(weights, "block2.1", one)))
    down = _pool(two)
    dense = smish(_conv(weights, "block3.1", smish(down + _conv(weights, "side1", one[::2, ::2]))))
    three = 0.5 * (_conv(weights, "block3.2", dense) + _conv(weights, "pre3", down))
    maps = [_up(weights, "up1", smish(_conv(weights, "out1", one))),
            _up(weights, "up2", smish(_conv(weights, "out2", two)))]
    high = _up(weights, "up3.1", smish(_conv(weights, "out3.1", three)))
    maps.append(_up(weights, "up3.2", smish(_conv(weights, "out3.2", high))))
    first = _depthwise(weights, "fuse1", smish(np.concatenate(maps, axis=-1)))
    return expit((first + _depthwise(weights, "fuse2", first)).sum(axis=-1))


def normalise(image: np.ndarray) -> np.ndarray:
    """float32 with mean 0 and rms 1 over the image (over the last two axes)."""
    x = image.astype(np.float32)
    x = x - x.mean(axis=(-2, -1), keepdims=True)
    return x / (x.std(axis=(-2, -1), keepdims=True) + np.float32(1.0))


def build_keras(widths: tuple[int, int, int] = WIDTHS) -> "keras.Model":
    """The same network in Keras, images (n, rows, columns, 1) in, logits of the same shape out."""
    import keras
    from keras import layers as kl
    from keras import ops

    shapes = layers(widths)

    def act(x):
        return keras.layers.Lambda(_keras_smish)(x)

    def conv(name, x, stride=1):
        return kl.Conv2D(shapes[name][3], shapes[name][:2], strides=stride, padding="same",
                         name=name.replace(".", "_"))(x)

    def up(name, x):
        return kl.Conv2DTranspose(shapes[name][2], shapes[name][:2], strides=2, padding="same",
                                  name=name.replace(".", "_"))(x)

    def depthwise(name, x):
        return kl.DepthwiseConv2D(shapes[name][:2], depth_multiplier=shapes[name][3], padding="same",
                                  name=name.replace(".", "_"))(x)

    image = keras.Input((None, None, 1))
    one = act(conv("block1.2", act(conv("block1.1", image, 2))))
    two = conv("block2.2", act(conv("block2.1", one)))
    down = kl.MaxPooling2D(3, 2, padding="same")(two)
    side = conv("side1", kl.Lambda(lambda x: x[:, ::2, ::2])(one))
    three = conv("block3.2", act(conv("block3.1", act(kl.Add()([down, side])))))
    three = kl.Average()([three, conv("pre3", down)])
    maps = [up("up1", act(conv("out1", one))), up("up2", act(conv("out2", two))),
            up("up3.2", act(conv("out3.2", up("up3.1", act(conv("out3.1", three))))))]
    first = depthwise("fuse1", act(kl.Concatenate()(maps)))
    logit = kl.Lambda(lambda x: ops.sum(x, axis=-1, keepdims=True))(kl.Add()([first, depthwise("fuse2", first)]))
    return keras.Model(image, logit, name="teed")


def weights_of_keras(model: "keras.Model") -> dict[str, np.ndarray]:
    """"NAME.kernel" and "NAME.bias" of every layer."""
    weights = {}
    for name in layers():
        kernel, bias = model.get_layer(name.replace(".", "_")).get_weights()
        weights[f"{name}.kernel"], weights[f"{name}.bias"] = kernel, bias
    return weights


def _keras_smish(x):
    from keras import ops

    y = ops.square(1.0 + ops.sigmoid(x))
    return x * (y - 1.0) / (y + 1.0)


def _conv(weights: Weights, name: str, x: np.ndarray, stride: int = 1) -> np.ndarray:
    """A convolution that keeps the size ("same"), with its bias; stride 2 pads behind, as TensorFlow does."""
    kernel = weights[f"{name}.kernel"]
    if kernel.shape[:2] == (1, 1):
        return x @ kernel[0, 0] + weights[f"{name}.bias"]
    before = 1 if stride == 1 else 0
    padded = np.pad(x, ((before, 1), (before, 1), (0, 0)))
    windows = np.lib.stride_tricks.sliding_window_view(padded, (3, 3), axis=(0, 1))[::stride, ::stride]
    rows, columns = windows.shape[:2]
    flat = np.ascontiguousarray(windows.transpose(0, 1, 3, 4, 2)).reshape(rows * columns, -1)
    return (flat @ kernel.reshape(-1, kernel.shape[3]) + weights[f"{name}.bias"]).reshape(rows, columns, -1)


def _pool(x: np.ndarray) -> np.ndarray:
    """Maximum over 3 x 3, every second place, padded behind as TensorFlow does."""
    padded = np.pad(x, ((0, 1), (0, 1), (0, 0)), constant_values=-np.inf)
    return np.lib.stride_tricks.sliding_window_view(padded, (3, 3), axis=(0, 1))[::2, ::2].max(axis=(-2, -1))


def _up(weights: Weights, name: str, x: np.ndarray) -> np.ndarray:
    """A transposed convolution of stride 2 that doubles the size."""
    kernel = weights[f"{name}.kernel"]
    size = kernel.shape[0]
    rows, columns = x.shape[:2]
    out = np.zeros((2 * rows + size - 2, 2 * columns + size - 2, kernel.shape[2]), x.dtype)
    for i in range(size):
        for j in range(size):
            out[i:i + 2 * rows:2, j:j + 2 * columns:2] += x @ kernel[i, j].T
    cut = (size - 2) // 2
    return out[cut:cut + 2 * rows, cut:cut + 2 * columns] + weights[f"{name}.bias"]


def _depthwise(weights: Weights, name: str, x: np.ndarray) -> np.ndarray:
    """A depthwise 3 x 3 convolution that keeps the size; output channel of input c and multiplier m is c M + m."""
    kernel = weights[f"{name}.kernel"]
    padded, (rows, columns, channels) = np.pad(x, ((1, 1), (1, 1), (0, 0))), x.shape
    out = np.zeros((rows, columns, channels, kernel.shape[3]), x.dtype)
    for i in range(3):
        for j in range(3):
            out += padded[i:i + rows, j:j + columns, :, None] * kernel[i, j]
    return out.reshape(rows, columns, -1) + weights[f"{name}.bias"]
