"""Model files: named arrays and JSON metadata in one `.npz`, read without trusting a byte of it."""

import io
import json
import zipfile
from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from airtouch.errors import AirTouchError, printable
from airtouch.reference.networks.int8_network import Int8Layer

LARGEST = 8 << 20  #: bytes of the file, and of all its arrays together; chosen, far above any model
MOST = 1e9  #: size of a setting in a model's metadata; chosen, fits the int32 of the kernels
MOST_S = 10.0  #: s, most lag and timing error of a model; chosen, far above any
REMEDY = "train it again with `airtouch train`"

Shapes = Mapping[str, tuple[type, tuple[int, ...]]]  #: dtype and shape of each array that must be there


def to_bytes(arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> bytes:
    """The file's content; the same arrays and metadata give the same bytes."""
    text = json.dumps(dict(metadata), sort_keys=True, allow_nan=False)
    content = io.BytesIO()
    np.savez_compressed(content, allow_pickle=False, **dict(sorted(arrays.items())),
                        metadata=np.frombuffer(text.encode(), dtype=np.uint8))
    return content.getvalue()


def read(path: Path) -> bytes:
    """A file's bytes; AirTouchError where it cannot be read or is too large."""
    try:
        if path.stat().st_size > LARGEST:
            raise AirTouchError(f"{path}: too large for a model file")
        return path.read_bytes()
    except FileNotFoundError as error:
        shipped = resources.files("airtouch") / "models"
        raise AirTouchError(f"{path}: cannot be read: {error.strerror}; the shipped models are in {shipped}") from None
    except OSError as error:
        raise AirTouchError(f"{path}: cannot be read: {error.strerror or error}") from None


def parse(data: bytes, source: str) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """(arrays, metadata) of a file's content. Raises AirTouchError for anything that is not a model file."""
    not_one = AirTouchError(f"{source}: not a model file (.npz written by `airtouch train`); {REMEDY}")
    if not data.startswith(b"PK"):
        raise not_one
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            if sum(entry.file_size for entry in archive.infolist()) > LARGEST:
                raise not_one
        with np.load(io.BytesIO(data), allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
    except AirTouchError:
        raise
    except Exception:  # a damaged zip or array header raises nearly anything
        raise not_one from None
    if not all(isinstance(values, np.ndarray) for values in arrays.values()):
        raise not_one
    try:
        metadata = json.loads(arrays.pop("metadata").tobytes().decode())
    except (KeyError, ValueError, RecursionError):
        metadata = None
    if not isinstance(metadata, dict):
        raise AirTouchError(f"{source}: this model says nothing of how it was made; {REMEDY}")
    return arrays, metadata


def check_kind(metadata: dict[str, Any], expected: Mapping[str, Any], source: str) -> None:
    """Remove the `expected` keys from the metadata; raises AirTouchError where one has another value."""
    for key, value in expected.items():
        actual = metadata.pop(key, None)
        if actual != value:
            raise AirTouchError(f"{source}: model {key} {actual!r}, this detector needs {value!r}; {REMEDY}")


def check_metadata(metadata: Mapping[str, Any], source: str) -> None:
    """Raise AirTouchError where lag, timing error or lists of flights, if they are there, are of the wrong kind."""
    for key, low in (("lag_s", -MOST_S), ("sigma_s", 0.0)):
        if key in metadata:
            _check_number(metadata[key], key, source, low, MOST_S)
    for key in ("flights", "flight_hashes", "free_air_hashes", "held_out", "held_out_hashes"):
        names = metadata.get(key, [])
        if not (isinstance(names, list) and all(isinstance(name, str) for name in names)):
            raise AirTouchError(f"{source}: {key} is not a list of texts; {REMEDY}")


def check_settings(table: Any, defaults: Mapping[str, float], source: str) -> None:
    """Raise AirTouchError where a setting is no number, or no count where its default is one."""
    if not isinstance(table, dict):
        raise AirTouchError(f"{source}: settings are not a table; {REMEDY}")
    for name in table.keys() & defaults.keys():
        whole = isinstance(defaults[name], int)
        _check_number(table[name], name, source, 0 if whole else -MOST, MOST, whole)


def _check_number(value: object, name: str, source: str, low: float, high: float, whole: bool = False) -> None:
    """Raise AirTouchError for anything but a number, or a whole one, from low to high."""
    kind = isinstance(value, int if whole else (int, float)) and not isinstance(value, bool)
    if not (kind and low <= value <= high):  # type: ignore[operator]
        raise AirTouchError(f"{source}: {name} is {printable(repr(value))}, not a {'whole ' * whole}number from "
                            f"{low:g} to {high:g}; {REMEDY}")


def check_arrays(arrays: Mapping[str, np.ndarray], shapes: Shapes, source: str) -> None:
    """Raise AirTouchError for an array that is missing, of another shape or type, or not finite."""
    for name, (dtype, shape) in shapes.items():
        values = arrays.get(name)
        if values is None:
            raise AirTouchError(f"{source}: no array {name!r} in this model; {REMEDY}")
        if values.shape != shape:
            raise AirTouchError(f"{source}: a model of another shape: {name} is {values.shape}, "
                                f"this network needs {shape}; {REMEDY}")
        if values.dtype != dtype:
            raise AirTouchError(f"{source}: {name} is {values.dtype}, {np.dtype(dtype)} is needed; {REMEDY}")
        if values.dtype.kind == "f" and not np.isfinite(values).all():
            raise AirTouchError(f"{source}: {name} holds values that are not finite; {REMEDY}")


def check_range(layers: Sequence[Int8Layer], source: str) -> None:
    """Raise AirTouchError where an accumulator may exceed 2^28, the limit of the kernels' rounding, for some input.

    An output whose weights are all pruned is constant: its bias may fill int32, its scale must be below one.
    """
    for layer in layers:
        if not layer.weighted:
            continue
        real = layer.weight_scale.astype(np.float64) * (layer.input_scale / layer.output_scale)
        weights = np.abs(layer.weights.astype(np.int64)).reshape(len(layer.bias), -1).sum(axis=1)
        largest = np.abs(layer.bias.astype(np.int64)) + 256 * weights
        too_large = largest * np.maximum(real, 1.0) >= 2.0**28
        if np.where(weights > 0, too_large, real > 1.0).any():
            raise AirTouchError(f"{source}: int8 biases or scales out of range; {REMEDY}")
