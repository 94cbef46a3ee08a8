"""A trained model of `paper` or `paper-stream` as one `.npz` file: float and int8 weights, scales, metadata.

Arrays: "<layer>.kernel" and "<layer>.bias" float32 as Keras lays them out, "int8.<layer>.weights",
"int8.<layer>.bias", "int8.<layer>.weight_scale", "int8.scale" and "int8.zero_point" (input, then
each layer's output), "scale.mean" and "scale.deviation" where inputs are on a fixed scale, "tflite" (the same int8
network as a TFLite file, for comparison) and "metadata" (JSON, UTF-8). Nothing in the file is ever executed.
"""

import hashlib
from dataclasses import asdict, dataclass
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from airtouch.detector.paper.graph import INPUT_SHAPE
from airtouch.detector.paper.network import float_layers, weight_shapes
from airtouch.detector.paper.normalisation import FIXED, WINDOW, FixedScale
from airtouch.detector.paper.quantisation import arrays_of_network, int8_shapes, network_of_arrays
from airtouch.detector.shared import archive
from airtouch.errors import AirTouchError
from airtouch.kernels.network import FloatLayer
from airtouch.logs.files import write_bytes
from airtouch.parameters import DEFAULT
from airtouch.reference.networks.int8_network import Int8Network

FORMAT = 1


@dataclass(frozen=True)
class Model:
    """A trained paper network.

    weights: float32 arrays by name (`network.weight_shapes`). int8: the network that flies.
    tflite: the same as a TFLite file. metadata: plain JSON: parameters, flights, seed, command, ...
    scale: of the inputs, where it is fixed; None where each window is z-scored by itself.
    """

    weights: dict[str, np.ndarray]
    int8: Int8Network
    tflite: bytes
    metadata: dict[str, Any]
    scale: FixedScale | None = None

    @property
    def normalisation(self) -> str:
        """How features become inputs."""
        return FIXED if self.scale else WINDOW

    @property
    def float_layers(self) -> list[FloatLayer]:
        """The float network, for `airtouch.kernels.network.infer_float`."""
        return float_layers(self.weights)

    @property
    def digest(self) -> str:
        """SHA-256 of all that the int8 network computes with, hexadecimal."""
        total = hashlib.sha256()
        for name, values in sorted({**arrays_of_network(self.int8), **self._scale_arrays()}.items()):
            total.update(f"{name} {values.dtype.str} {values.shape}\n".encode() + values.tobytes())
        return total.hexdigest()

    def _scale_arrays(self) -> dict[str, np.ndarray]:
        """The arrays "scale..." of the file; none where each window is z-scored by itself."""
        return {"scale.mean": self.scale.mean, "scale.deviation": self.scale.deviation} if self.scale else {}

    def to_bytes(self) -> bytes:
        """The file's content; the same model gives the same bytes."""
        arrays = dict(self.weights)
        arrays |= {f"int8.{name}": values for name, values in arrays_of_network(self.int8).items()}
        arrays |= self._scale_arrays()
        arrays["tflite"] = np.frombuffer(self.tflite, dtype=np.uint8)
        return archive.to_bytes(arrays, {"format": FORMAT, "normalisation": self.normalisation, **self.metadata})

    def c_sources(self) -> dict[str, str]:
        """File name -> text of its C sources, without the lines that say where they came from."""
        from airtouch.detector.paper import export

        return export.render(self)

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
    return parse(archive.read(Path(path)), str(path))


def parse(data: bytes, source: str) -> Model:
    """A model from a file's content; `source` names it in messages. Raises as `load` does."""
    arrays, metadata = archive.parse(data, source)
    archive.check_metadata(metadata, source)
    archive.check_settings(metadata.get("parameters", {}), asdict(DEFAULT), source)
    fixed = metadata.get("normalisation") == FIXED
    archive.check_kind(metadata, {"format": FORMAT, "normalisation": FIXED if fixed else WINDOW}, source)
    expected: dict[str, tuple[type, tuple[int, ...]]] = {
        name: (np.float32, shape) for name, shape in weight_shapes().items()}
    if fixed:
        expected |= {f"scale.{part}": (np.float32, (INPUT_SHAPE[1],)) for part in ("mean", "deviation")}
    expected |= {f"int8.{name}": what for name, what in int8_shapes().items()}
    archive.check_arrays(arrays, expected, source)
    if "tflite" not in arrays or arrays["tflite"].dtype != np.uint8:
        raise AirTouchError(f"{source}: the TFLite file is missing from this model; {archive.REMEDY}")
    int8 = {name: arrays[f"int8.{name}"] for name in int8_shapes()}
    _check_int8(int8, source)
    network = network_of_arrays(int8)
    archive.check_range(network.layers, source)
    weights = {name: arrays[name] for name in weight_shapes()}
    scale = _scale(arrays, source) if fixed else None
    return Model(weights, network, arrays["tflite"].tobytes(), metadata, scale)


def _scale(arrays: dict[str, np.ndarray], source: str) -> FixedScale:
    """The inputs' scale; AirTouchError unless its deviations are positive."""
    scale = FixedScale(arrays["scale.mean"], arrays["scale.deviation"])
    if not (scale.deviation > 0).all():
        raise AirTouchError(f"{source}: the inputs' scale must be positive; {archive.REMEDY}")
    return scale


def _check_int8(arrays: dict[str, np.ndarray], source: str) -> None:
    """Raise AirTouchError for scales that are not positive, and for zero points that int8 does not hold."""
    if any((arrays[name] <= 0).any() for name in arrays if name.endswith("scale")):
        raise AirTouchError(f"{source}: int8 scales must be positive; {archive.REMEDY}")
    if np.abs(arrays["zero_point"].astype(np.int64)).max() > 128 or arrays["zero_point"].max() > 127:
        raise AirTouchError(f"{source}: int8 zero points must lie in -128..127; {archive.REMEDY}")
