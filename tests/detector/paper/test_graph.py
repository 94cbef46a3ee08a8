"""The paper's list of layers: shapes as Keras has them, operations as SciPy computes them."""

import numpy as np
import pytest
from scipy.signal import correlate

from airtouch.detector.paper.graph import (
    CONV,
    DENSE,
    GRAPH,
    INPUT_SHAPE,
    LAYERS,
    MAX_POOL,
    OPERATIONS,
    LayerSpec,
    graph_of,
)
from skips import needs


def test_it_is_the_network_of_section_5_2():
    """100 x 3 inputs, 16 and 32 filters of 3 x 1 with pools of 2 x 1, 16 and 2 outputs: 36,944 weights, 66 biases."""
    assert [layer.output_shape for layer in GRAPH] == [(98, 3, 16), (49, 3, 16), (47, 3, 32), (23, 3, 32), (1, 1, 16),
                                                       (1, 1, 2)]
    shapes = [layer.kernel_shape for layer in GRAPH if layer.kernel_shape]
    assert sum(int(np.prod(s)) for s in shapes) == 36944 and sum(s[-1] for s in shapes) == 66


OTHER = (LayerSpec("a", CONV, (4, 2), 5, relu=True), LayerSpec("b", MAX_POOL, (3, 1)), LayerSpec("c", CONV, (2, 1), 6),
         LayerSpec("d", DENSE, outputs=7), LayerSpec("e", DENSE, outputs=3))


@needs("tensorflow")
@pytest.mark.parametrize("rows, shape", [(LAYERS, INPUT_SHAPE), (OTHER, (37, 4, 2))])
def test_shapes_are_those_of_keras(rows, shape):
    import keras

    graph = graph_of(rows, shape)
    x = keras.Input(shape)
    for layer in graph:
        keras_layers = OPERATIONS[layer.operation].keras(layer)
        for keras_layer in keras_layers:
            x = keras_layer(x)
        outputs = x.shape[1:] if len(x.shape) == 4 else (1, 1, x.shape[1])
        assert tuple(outputs) == layer.output_shape
        assert tuple(keras_layers[-1].weights[0].shape if keras_layers[-1].weights else ()) == layer.kernel_shape


@needs("tensorflow")
def test_operations_over_a_window_are_those_of_scipy():
    rng = np.random.default_rng(3)
    conv, pool, *_, dense, _ = graph_of(OTHER, (37, 4, 2))
    x = rng.normal(size=(1, 37, 4, 2)).astype(np.float32)
    kernel, bias = rng.normal(size=conv.kernel_shape).astype(np.float32), rng.normal(size=5).astype(np.float32)
    y = np.asarray(OPERATIONS[CONV].window(conv, kernel, bias, x))[0]
    true = np.stack([correlate(x[0], kernel[..., o], "valid")[..., 0] for o in range(5)], -1) + bias
    np.testing.assert_allclose(y, true, atol=1e-4)

    pooled = np.asarray(OPERATIONS[MAX_POOL].window(pool, None, None, y[None]))[0]
    np.testing.assert_array_equal(pooled, [[y[3 * i:3 * i + 3, j].max(axis=0) for j in range(y.shape[1])]
                                           for i in range(len(y) // 3)])

    x = rng.normal(size=(1, *dense.input_shape)).astype(np.float32)
    kernel, bias = rng.normal(size=dense.kernel_shape).astype(np.float32), rng.normal(size=7).astype(np.float32)
    np.testing.assert_allclose(np.asarray(OPERATIONS[DENSE].window(dense, kernel, bias, x))[0],
                               np.ravel(x) @ kernel + bias, atol=1e-4)
