"""A trained network as one `.npz` file: float and int8 weights, scales, and how they came about.

Arrays: "<layer>.kernel" and "<layer>.bias" float32 as Keras lays them out, "int8.<layer>.weights",
"int8.<layer>.bias", "int8.<layer>.weight_scale", "int8.scale" and "int8.zero_point" (input, then
each layer's output), "tflite" (the same int8 network as a TFLite file, for comparison) and
"metadata" (JSON, UTF-8). Nothing in the file is ever executed.
"""

import hashlib
import io
import json
import zipfile
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from airtouch.detector.network import float_layers, weight_shapes
from airtouch.detector.quantisation import arrays_of_network, int8_shapes, network_of_arrays
from airtouch.errors import AirTouchError
from airtouch.kernels.network import FloatLayer
from airtouch.logs.files import write_bytes
from airtouch.reference.int8_network import Int8Network

FORMAT = 1
NORMALISATION = "z-score of each window and column"
_LARGEST = 8 << 20  # bytes of the file, and of each array in it
_REMEDY = "train it again with `airtouch train`"


@dataclass(frozen=True)
class Model:
    """A trained paper network.

    weights: float32 arrays by name (`network.weight_shapes`). int8: the network that flies.
    tflite: the same as a TFLite file. metadata: plain JSON: parameters, flights, seed, command, ...
    """

    weights: dict[str, np.ndarray]
    int8: Int8Network
    tflite: bytes
    metadata: dict[str, Any]

    @property
    def float_layers(self) -> list[FloatLayer]:
        """The float network, for `airtouch.kernels.network.infer_float`."""
        return float_layers(self.weights)

    @property
    def digest(self) -> str:
        """SHA-256 of all that the int8 network computes with, hexadecimal."""
        total = hashlib.sha256()
        for name, values in sorted(arrays_of_network(self.int8).items()):
            total.update(f"{name} {values.dtype.str} {values.shape}\n".encode() + values.tobytes())
        return total.hexdigest()

    def to_bytes(self) -> bytes:
        """The file's content; the same model gives the same bytes."""
        arrays = dict(self.weights)
        arrays |= {f"int8.{name}": values for name, values in arrays_of_network(self.int8).items()}
        arrays["tflite"] = np.frombuffer(self.tflite, dtype=np.uint8)
        text = json.dumps({"format": FORMAT, "normalisation": NORMALISATION, **self.metadata},
                          sort_keys=True, allow_nan=False)
        arrays["metadata"] = np.frombuffer(text.encode(), dtype=np.uint8)
        stream = io.BytesIO()
        np.savez_compressed(stream, allow_pickle=False, **arrays)
        return stream.getvalue()

    def save(self, path: str | Path, force: bool = False) -> None:
        """Write it whole or not at all; AirTouchError where the file exists, unless forced."""
        write_bytes(self.to_bytes(), Path(path), force)


def load(path: str | Path | None = None) -> Model:
    """A model from its file, the shipped one for None.

    Raises AirTouchError, one line, for anything but a complete model of this network.
    """
    if path is None:
        with resources.as_file(resources.files("airtouch") / "models" / "paper.npz") as shipped:
            return load(shipped)
    path = Path(path)
    try:
        if path.stat().st_size > _LARGEST:
            raise AirTouchError(f"{path}: too large for a model file")
        data = path.read_bytes()
    except OSError as error:
        raise AirTouchError(f"{path}: cannot be read: {error.strerror or error}") from None
    return parse(data, str(path))


def parse(data: bytes, source: str) -> Model:
    """A model from a file's content; `source` names it in messages. Raises as `load` does."""
    arrays = _arrays(data, source)
    metadata = _metadata(arrays.pop("metadata", None), source)
    expected = {name: (np.float32, shape) for name, shape in weight_shapes().items()}
    expected |= {f"int8.{name}": what for name, what in int8_shapes().items()}
    for name, (dtype, shape) in expected.items():
        _check_array(arrays.get(name), name, dtype, shape, source)
    if "tflite" not in arrays or arrays["tflite"].dtype != np.uint8:
        raise AirTouchError(f"{source}: the TFLite file is missing from this model; {_REMEDY}")
    int8 = {name: arrays[f"int8.{name}"] for name in int8_shapes()}
    _check_int8(int8, source)
    network = network_of_arrays(int8)
    _check_range(network, source)
    return Model({name: arrays[name] for name in weight_shapes()}, network, arrays["tflite"].tobytes(), metadata)


def _arrays(data: bytes, source: str) -> dict[str, np.ndarray]:
    not_one = AirTouchError(f"{source}: not a model file (.npz written by `airtouch train`); {_REMEDY}")
    if not data.startswith(b"PK"):
        raise not_one
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            if sum(entry.file_size for entry in archive.infolist()) > _LARGEST:
                raise not_one
        with np.load(io.BytesIO(data), allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
    except AirTouchError:
        raise
    except Exception:  # a damaged zip or array header raises nearly anything
        raise not_one from None
    if not all(isinstance(values, np.ndarray) for values in arrays.values()):
        raise not_one
    return arrays


def _metadata(values: np.ndarray | None, source: str) -> dict[str, Any]:
    try:
        metadata = json.loads(values.tobytes().decode())
        form, normalisation = metadata.pop("format"), metadata.pop("normalisation")
    except (AttributeError, KeyError, TypeError, ValueError, RecursionError):
        raise AirTouchError(f"{source}: this model says nothing of how it was made; {_REMEDY}") from None
    if form != FORMAT:
        raise AirTouchError(f"{source}: model format {form!r}, this version reads {FORMAT}; {_REMEDY}")
    if normalisation != NORMALISATION:
        raise AirTouchError(f"{source}: made for inputs normalised by {normalisation!r}, "
                            f"this detector gives {NORMALISATION!r}; {_REMEDY}")
    return metadata


def _check_array(values: np.ndarray | None, name: str, dtype: type, shape: tuple[int, ...], source: str) -> None:
    if values is None:
        raise AirTouchError(f"{source}: no array {name!r} in this model; {_REMEDY}")
    if values.shape != shape:
        raise AirTouchError(f"{source}: a model of another shape: {name} is {values.shape}, "
                            f"this network needs {shape}; {_REMEDY}")
    if values.dtype != dtype:
        raise AirTouchError(f"{source}: {name} is {values.dtype}, {np.dtype(dtype)} is needed; {_REMEDY}")
    if values.dtype.kind == "f" and not np.isfinite(values).all():
        raise AirTouchError(f"{source}: {name} holds values that are not finite; {_REMEDY}")


def _check_int8(arrays: dict[str, np.ndarray], source: str) -> None:
    if any((arrays[name] <= 0).any() for name in arrays if name.endswith("scale")):
        raise AirTouchError(f"{source}: int8 scales must be positive; {_REMEDY}")
    if np.abs(arrays["zero_point"].astype(np.int64)).max() > 128 or arrays["zero_point"].max() > 127:
        raise AirTouchError(f"{source}: int8 zero points must lie in -128..127; {_REMEDY}")


def _check_range(network: Int8Network, source: str) -> None:
    """No accumulator may leave int32, whatever the input."""
    for layer in network.layers:
        if layer.kind == "max_pool":
            continue
        real = np.float64(layer.input_scale) * layer.weight_scale.astype(np.float64) / np.float64(layer.output_scale)
        weights = np.abs(layer.weights.astype(np.int64)).reshape(len(layer.bias), -1).sum(axis=1)
        largest = np.abs(layer.bias.astype(np.int64)) + 256 * weights
        if (largest * np.maximum(real, 1.0) * 2.0 >= 2.0**31).any():
            raise AirTouchError(f"{source}: int8 biases or scales out of range; {_REMEDY}")
