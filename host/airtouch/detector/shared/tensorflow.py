"""What both trainers need of TensorFlow: a fixed start, and a network of one tensor as an int8 TFLite file."""

import contextlib
import functools
import gc
import os
import warnings
from collections.abc import Callable, Iterator

import numpy as np

from airtouch.errors import AirTouchError


def use_tensorflow(seed: int) -> None:
    """Import TensorFlow, quietly, and fix every source of chance. Raises AirTouchError where it is not installed."""
    os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")
    os.environ.setdefault("TF_ENABLE_ONEDNN_OPTS", "0")  # one order of summation
    os.environ.setdefault("CUDA_VISIBLE_DEVICES", "-1")  # one machine, one result
    try:
        import keras
        import tensorflow as tf
    except ImportError:
        raise AirTouchError("training needs TensorFlow: pip install 'airtouch[train]'") from None
    _keep_what_is_imported()
    tf.get_logger().setLevel("ERROR")
    keras.backend.clear_session()
    keras.utils.set_random_seed(seed)
    tf.config.experimental.enable_op_determinism()


@functools.cache
def _keep_what_is_imported() -> None:
    """TensorFlow is half a million objects, which `clear_session` would look through for garbage each time."""
    gc.freeze()


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


def read_weighted_layers(content: bytes) -> list[dict[str, np.ndarray]]:
    """The layers with weights of a TFLite file that `convert` made, in order.

    Each: weights int8 (out, ...), bias int32 (out,), weight_scale float32 (out,), and scale float32 and
    zero_point int32 of input and output, (2,).
    """
    from tensorflow.lite.python import schema_py_generated as schema

    model = schema.ModelT.InitFromObj(schema.Model.GetRootAs(content, 0))
    graph = model.subgraphs[0]
    layers = []
    for op in graph.operators:
        constant = [model.buffers[graph.tensors[i].buffer].data is not None for i in op.inputs]
        if constant != [False, True, True]:  # input, kernel, bias
            continue
        tensors = [graph.tensors[i] for i in (*op.inputs, op.outputs[0])]
        kernel, bias = tensors[1], model.buffers[tensors[2].buffer].data
        around = [tensors[0].quantization, tensors[3].quantization]
        values = np.array(model.buffers[kernel.buffer].data, dtype=np.uint8).view(np.int8)
        layers.append({
            "weights": np.moveaxis(values.reshape(kernel.shape), kernel.quantization.quantizedDimension, 0),
            "bias": np.frombuffer(bytes(bias), dtype="<i4").copy(),
            "weight_scale": np.broadcast_to(np.asarray(kernel.quantization.scale, dtype=np.float32),
                                            (len(bias) // 4,)).copy(),
            "scale": np.array([q.scale[0] for q in around], dtype=np.float32),
            "zero_point": np.array([q.zeroPoint[0] for q in around], dtype=np.int32),
        })
    return layers


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
