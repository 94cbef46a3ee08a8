"""A trained model of `best` as one `.npz` file: float and int8 weights, decoder settings, how it came about.

Arrays: "<layer>.kernel" and "<layer>.bias" float32; "int8.<layer>.weights", ".bias", ".weight_scale", ".scale" and
".zero_point" (input, output); "tflite"; "metadata" (JSON, UTF-8), with the names of the motion channels where they are
not those of the first files. Nothing in the file is ever executed.
"""

import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from airtouch import vehicle as vehicles
from airtouch.detector.best.network import weight_shapes
from airtouch.detector.best.quantisation import network_of
from airtouch.detector.best.recipe import Recipe
from airtouch.detector.shared import archive
from airtouch.errors import AirTouchError
from airtouch.logs.files import write_bytes
from airtouch.reference.edge_decoder import DecoderConfig
from airtouch.reference.motion_channels import NAMES
from airtouch.reference.networks.stream_int8 import StreamNetwork
from airtouch.vehicle import Vehicle

FORMAT = 1  #: version of the file's layout
SHIPPED = "best.npz"
#: sensor -> shipped model for logs that lack it
SPARES = {"acceleration": "best_without_acceleration.npz"}
KIND = {"format": FORMAT, "network": "stream"}  #: metadata that tell this file from that of another network
_INT8 = {"weights": np.int8, "bias": np.int32, "weight_scale": np.float32, "scale": np.float32, "zero_point": np.int32}
#: channels of files that name none: so that a file is as it was before they could be others
_FIRST_CHANNELS = ("ax", "ay", "az", "gyro x", "gyro y", "gyro z", "motor roll", "motor pitch", "motor yaw",
                   "motor mean", "unexplained az", "zero")
#: settings of files written before these fields existed
_BEFORE = {"silent_acceleration": 0.0, "silent_rates": 0.0, "silent_motors": 0.0, "phases": 0.0, "free_air_share": 0.0}


@dataclass(frozen=True)
class BestModel:
    """A trained model of `best`.

    recipe: shape of its network, and how it was trained. weights: float32 arrays by name (`network.weight_shapes`).
    int8: the network that flies. tflite: the same network over one window, as a TFLite file. metadata: plain JSON:
    decoder, lag_s, flights, seed, command, ... spares: models for logs that lack a sensor, by the sensor's name; each
    has a file of its own.
    """

    recipe: Recipe
    weights: dict[str, np.ndarray]
    int8: StreamNetwork
    tflite: bytes
    metadata: dict[str, Any]
    spares: Mapping[str, "BestModel"] = field(default_factory=dict)

    def serving(self, missing: Sequence[str]) -> "BestModel":
        """The model for a log that lacks these sensors: a spare where there is one, else this one."""
        return next((self.spares[sensor] for sensor in missing if sensor in self.spares), self)

    @property
    def decoder(self) -> DecoderConfig:
        """The decoder's settings."""
        return self._settings(self.metadata.get("decoder"))

    def decoder_without(self, missing: Sequence[str]) -> DecoderConfig:
        """The decoder's settings for a log that lacks these sensors, `decoder` where there are none of their own."""
        own = self.metadata.get("decoder_without", {})
        for sensor in missing:
            if sensor in own:
                return self._settings(own[sensor])
        return self.decoder

    @staticmethod
    def _settings(table: Any) -> DecoderConfig:
        """The decoder's settings in a table of metadata; AirTouchError for those of another version."""
        try:
            return DecoderConfig(**table)
        except TypeError:
            raise AirTouchError(f"the model's decoder settings are not those of this version; "
                                f"{archive.REMEDY}") from None

    @property
    def digest(self) -> str:
        """SHA-256 of all that the int8 network computes with, hexadecimal."""
        total = hashlib.sha256(repr((self.int8.stride, self.int8.graph[-1].reads[0], self.recipe.dilations)).encode())
        for name, values in self._int8_arrays().items():
            total.update(f"{name} {values.dtype.str} {values.shape}\n".encode() + values.tobytes())
        return total.hexdigest()

    def _int8_arrays(self) -> dict[str, np.ndarray]:
        """The arrays "int8..." of the file."""
        arrays = {}
        for of, layer in zip(self.int8.graph, self.int8.layers, strict=True):
            parts = {"weights": layer.weights, "bias": layer.bias, "weight_scale": layer.weight_scale,
                     "scale": np.array([layer.input_scale, layer.output_scale], np.float32),
                     "zero_point": np.array([layer.input_zero_point, layer.output_zero_point], np.int32)}
            arrays |= {f"int8.{of.name}.{part}": values for part, values in parts.items()}
        return arrays

    def to_bytes(self) -> bytes:
        """The file's content; the same model gives the same bytes."""
        arrays = {**self.weights, **self._int8_arrays(), "tflite": np.frombuffer(self.tflite, dtype=np.uint8)}
        recipe = asdict(self.recipe)
        if self.recipe.vehicle is None:
            del recipe["vehicle"]  # so that a file is as it was before there was a choice
        channels = {} if NAMES == _FIRST_CHANNELS else {"channels": NAMES}
        return archive.to_bytes(arrays, {**KIND, "recipe": recipe, **channels, **self.metadata})

    def c_sources(self) -> dict[str, str]:
        """File name -> text of its C sources, without the lines that say where they came from."""
        from airtouch.detector.best import export

        return export.render(self)

    def save(self, path: str | Path, force: bool = False) -> None:
        """Write it whole or not at all; AirTouchError where the file exists, unless forced."""
        write_bytes(self.to_bytes(), Path(path), force)


def load(path: str | Path | None = None) -> BestModel:
    """A model from its file, the shipped one with its spares for None.

    Raises AirTouchError, one line, for anything else.
    """
    if path is None:
        spares = {sensor: _shipped(name) for sensor, name in SPARES.items()}
        return replace(_shipped(SHIPPED), spares=spares)
    return parse(archive.read(Path(path)), str(path))


def is_shipped(model: BestModel, missing: Sequence[str]) -> bool:
    """Whether network and decoder are those that the shipped model has for a log that lacks these sensors.

    False also where the shipped models have another shape than the networks of this version, as after a change of
    `Recipe.graph` or of the outputs.
    """
    try:
        shipped = load(None).serving(missing)
    except AirTouchError:
        return False
    return (model is shipped or model.digest == shipped.digest) and (
        model.decoder_without(missing) == shipped.decoder_without(missing))


@cache
def _shipped(name: str) -> BestModel:
    """A model that ships, read once."""
    with resources.as_file(resources.files("airtouch") / "models" / name) as path:
        return load(path)


def parse(data: bytes, source: str) -> BestModel:
    """A model from a file's content; `source` names it in messages. Raises as `load` does."""
    arrays, metadata = archive.parse(data, source)
    archive.check_kind(metadata, KIND, source)
    if metadata.pop("channels", list(_FIRST_CHANNELS)) != list(NAMES):
        raise AirTouchError(f"{source}: a model of other motion channels than {', '.join(NAMES)}; {archive.REMEDY}")
    recipe = _recipe(metadata.pop("recipe", None), source)
    floats = weight_shapes(recipe.graph)
    shapes: dict[str, tuple[type, tuple[int, ...]]] = {name: (np.float32, shape) for name, shape in floats.items()}
    for layer in recipe.graph:
        weights = math.prod(floats[f"{layer.name}.kernel"]) // layer.outputs
        sizes = {"weights": (layer.outputs, weights), "bias": (layer.outputs,),
                 "weight_scale": (layer.outputs,),
                 "scale": (2,), "zero_point": (2,)}
        shapes |= {f"int8.{layer.name}.{part}": (_INT8[part], size) for part, size in sizes.items()}
    archive.check_arrays(arrays, shapes, source)
    if "tflite" not in arrays or arrays["tflite"].dtype != np.uint8:
        raise AirTouchError(f"{source}: the TFLite file is missing from this model; {archive.REMEDY}")
    layers = [{part: arrays[f"int8.{layer.name}.{part}"] for part in _INT8} for layer in recipe.graph]
    for part in layers:
        positive = (part["scale"] > 0).all() and (part["weight_scale"] > 0).all()
        if not positive or not ((part["zero_point"] >= -128) & (part["zero_point"] <= 127)).all():
            raise AirTouchError(f"{source}: int8 scales or zero points out of range; {archive.REMEDY}")
    try:
        int8 = network_of(layers, recipe)
    except AirTouchError as error:
        raise AirTouchError(f"{source}: {error}; {archive.REMEDY}") from None
    archive.check_range(int8.layers, source)
    model = BestModel(recipe, {name: arrays[name] for name in floats}, int8,
                        arrays["tflite"].tobytes(), metadata)
    _check_metadata(model, source)
    return model


def _recipe(table: Any, source: str) -> Recipe:
    """The recipe in a model's metadata. Raises AirTouchError for a shape that this version does not run."""
    wrong = AirTouchError(f"{source}: the network's shape is missing or not one that this version runs; "
                          f"{archive.REMEDY}")
    if not isinstance(table, dict):
        raise wrong
    try:
        craft = _vehicle(table.get("vehicle"), source)
    except TypeError:
        raise wrong from None
    try:
        return Recipe(**{**_BEFORE, **table, "dilations": tuple(table["dilations"]), "muted": tuple(table["muted"]),
                         "vehicle": craft})
    except (KeyError, TypeError, AirTouchError):
        raise wrong from None


def _vehicle(table: Any, source: str) -> Vehicle | None:
    """The vehicle in a recipe; AirTouchError, and TypeError where a field is missing, for anything else."""
    if table is None:
        return None
    if not isinstance(table, dict):
        raise AirTouchError(f"{source}: vehicle is not a table; {archive.REMEDY}")
    return Vehicle(**vehicles.numbers({name: value for name, value in table.items() if value is not None}, source))


def _check_metadata(model: BestModel, source: str) -> None:
    """Raise AirTouchError unless lag and decoder settings are numbers that a decoder can have."""
    archive.check_metadata({"lag_s": None, **model.metadata}, source)
    own = model.metadata.get("decoder_without", {})
    if not isinstance(own, dict):
        raise AirTouchError(f"{source}: decoder settings are not a table; {archive.REMEDY}")
    for table in (model.metadata.get("decoder"), *own.values()):
        archive.check_settings(table, asdict(DecoderConfig()), source)
    for missing in ((), *((sensor,) for sensor in own)):
        model.decoder_without(missing)  # raises for a name that no decoder has
