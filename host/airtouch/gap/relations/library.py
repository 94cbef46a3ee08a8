"""The library: what was learned of one vehicle in one scenario, its file, and for which flights it holds."""

import io
import json
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple, SupportsIndex

import numpy as np

from airtouch.gap.features.feature_space import Standard
from airtouch.gap.relations.effect_class import ClassCalibration, EffectClass
from airtouch.gap.relations.hypotheses import LearnedModel
from airtouch.gap.relations.readout import Readout
from airtouch.logs.files import write_bytes
from airtouch.vehicle import Vehicle, load

SHIPPED_FILE = "diagnosis.npz"
#: standard deviations of nominal flights' excess distance; flights whose median is larger are not as those that were
#: learned from; chosen. A larger number uses the library for flights that are less like them
FARTHEST_NOMINAL = 4.0
CLASS_ARRAYS = ("knots", "table", "axes", "variances")  #: arrays of a class in a file
#: fields of a calibration that are fractions of the evidence; each an array of all classes in a file
SHARE_FIELDS = ("nameless_share", "second_share", "distance_scatter")
#: type of most arrays of a file; it moves a coordinate by less than a tenth of its nominal standard deviation
HALF_PRECISION = np.float16
#: ends of the names of the arrays of a file that are in float32
SINGLE_PRECISION = ("knots", "variances", "strength", "amount", "standard.middle", "standard.deviation")


class NominalDistance(NamedTuple):
    """Squared length of the coordinates of nominal flights that were not learned from: median, standard deviation."""

    median: float
    deviation: float


@dataclass(frozen=True)
class Coordinates:
    """The map from a flight's features to its coordinates, Q of them, of which nominal flights have the covariance 1.

    Features are standardised, multiplied by `projection` (features, Q), and `middle` (Q,), the nominal mean, is
    subtracted.
    """

    standard: Standard
    projection: np.ndarray
    middle: np.ndarray

    def __call__(self, features: np.ndarray) -> np.ndarray:
        """Coordinates (n, Q) of features (n, features)."""
        return self.standard(features) @ self.projection - self.middle

    def arrays(self) -> dict[str, np.ndarray]:
        """The arrays by their names in a file."""
        return {"standard.middle": self.standard.middle, "standard.deviation": self.standard.deviation,
                "projection": self.projection, "middle": self.middle}

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray]) -> "Coordinates":
        """The map of `arrays`, maybe among others."""
        return cls(Standard(arrays["standard.middle"], arrays["standard.deviation"]), arrays["projection"],
                   arrays["middle"])

    def rounded(self) -> "Coordinates":
        """The map as a file holds it."""
        return Coordinates.of({name: array.astype(float) for name, array in _rounded(self.arrays()).items()})


@dataclass(frozen=True)
class Library:
    """The model of one vehicle, by its name, in one scenario, and the coordinates that it is written in.

    distance: of nominal flights; pair_distance_scatter: what two effects add to the `distance_scatter` of their classes
    (`ClassCalibration`), a fraction of the evidence.
    """

    scenario: str
    vehicle: str
    coordinates: Coordinates
    model: LearnedModel
    distance: NominalDistance
    pair_distance_scatter: float = 0.0

    def __reduce_ex__(self, protocol: SupportsIndex) -> str | tuple[Any, ...]:
        """Other processes read the shipped library from their own package: it is 30 MB of a study that is sent."""
        return (shipped, ()) if self is shipped() else super().__reduce_ex__(protocol)

    @property
    def nominal_excess_deviation(self) -> float:
        """Standard deviation of the excess distance of nominal flights, nats."""
        return 0.5 * self.distance.deviation

    def excess_deviation(self, distance_scatter: float, evidence: float) -> float:
        """Standard deviation of the excess distance of flights with effects, nats.

        Two independent parts of it add: that of nominal flights, and `distance_scatter` (a fraction, as in
        `ClassCalibration`) times the evidence for the effects, nats.
        """
        return float(np.hypot(self.nominal_excess_deviation, distance_scatter * evidence))

    def excess(self, squared_distance: float) -> float:
        """Excess distance, nats: half of what a squared distance has beyond that of the median nominal flight."""
        return 0.5 * (squared_distance - self.distance.median)

    def lies_as_nominal(self, coordinates: np.ndarray) -> bool:
        """Whether flights (n, Q) said to be nominal lie as those do that were learned from."""
        median = float(np.median((coordinates ** 2).sum(axis=1))) if len(coordinates) else np.inf
        return self.excess(median) < FARTHEST_NOMINAL * self.nominal_excess_deviation

    @property
    def effects(self) -> frozenset[str]:
        """Names of the effects of the registry that it has classes of."""
        return frozenset(c.effect for c in self.model.classes)

    @cached_property
    def choice_cost(self) -> Mapping[str, float]:
        """Nats that the choice among its classes costs each effect."""
        return {name: float(np.log(n)) for name, n in Counter(c.effect for c in self.model.classes).items()}

    def without(self, names: Iterable[str]) -> "Library":
        """The library without the classes of some effects."""
        excluded = frozenset(names)
        return self.with_classes(c for c in self.model.classes if c.effect not in excluded)

    def with_classes(self, classes: Iterable[EffectClass]) -> "Library":
        """The library with these classes in place of its own."""
        return replace(self, model=replace(self.model, classes=tuple(classes)))


def save(library: Library, path: Path, force: bool = False) -> None:
    """Write a library as npz, most numbers in half precision; raises AirTouchError as `logs.files.write_bytes`."""
    write_bytes(packed(library), path, force)


def _rounded(arrays: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The arrays in the precision of a file."""
    return {name: array.astype(np.float32 if name.endswith(SINGLE_PRECISION) else HALF_PRECISION)
            for name, array in arrays.items()}


def packed(library: Library) -> bytes:
    """The bytes of a library's file."""
    model = library.model
    arrays = {**library.coordinates.arrays(), "interaction": model.interaction, "nameless": model.nameless,
              **{name: np.array([getattr(c.calibration, name) for c in model.classes]) for name in SHARE_FIELDS}}
    for i, c in enumerate(model.classes):
        arrays |= {f"{i}.{part}": getattr(c, part) for part in CLASS_ARRAYS}
        if (readout := c.calibration.readout) is not None:
            arrays |= {f"{i}.strength": readout.strength, f"{i}.amount": readout.amount}
    words = {"scenario": library.scenario, "vehicle": library.vehicle, "distance": library.distance,
             "pair_scatter": library.pair_distance_scatter,
             "classes": [[c.name, c.effect, c.shape, c.parameters, c.signed] for c in model.classes],
             "readouts": [(r := c.calibration.readout) and r.parameters for c in model.classes]}
    file = io.BytesIO()
    np.savez_compressed(file, words=np.array(json.dumps(words)), **_rounded(arrays))  # type: ignore[arg-type]
    return file.getvalue()


def read(content: bytes) -> Library:
    """The library in the bytes of a file; raises ValueError where SHARE_FIELDS have not one number for each class."""
    with np.load(io.BytesIO(content)) as file:
        words = json.loads(str(file["words"]))
        arrays = {k: file[k].astype(float) for k in file.files if k != "words"}
    if any(len(arrays[name]) != len(words["classes"]) for name in SHARE_FIELDS):
        raise ValueError(f"a library of {len(words['classes'])} classes must have as many of {', '.join(SHARE_FIELDS)}")
    classes = tuple(
        EffectClass(name, effect, shape, parameters, signed, **{part: arrays[f"{i}.{part}"] for part in CLASS_ARRAYS},
                    calibration=ClassCalibration(_readout(words["readouts"][i], i, arrays),
                                                 **{share: float(arrays[share][i]) for share in SHARE_FIELDS}))
        for i, (name, effect, shape, parameters, signed) in enumerate(words["classes"]))
    return Library(
        words["scenario"], words["vehicle"], Coordinates.of(arrays),
        LearnedModel(classes, arrays["interaction"], arrays["nameless"]),
        distance=NominalDistance(*words["distance"]), pair_distance_scatter=words["pair_scatter"])


def _readout(parameters: Sequence[str] | None, place: int, arrays: Mapping[str, np.ndarray]) -> Readout | None:
    """The calibration of the class at a place of the file; None where it has none."""
    return Readout(tuple(parameters), arrays[f"{place}.strength"], arrays[f"{place}.amount"]) if parameters else None


@cache
def shipped() -> Library:
    """The library that comes with the package."""
    return read((resources.files("airtouch.gap.relations") / SHIPPED_FILE).read_bytes())


def library_for(vehicle: Vehicle, nominal: Sequence[np.ndarray | None]) -> Library | None:
    """The shipped library; None where it does not hold for flights of a vehicle.

    It holds for a vehicle that is declared as its own, by whatever name, if the nominal flights lie as its own do.
    vehicle: as declared; nominal: features (features,) of its nominal flights, None of one whose log lacks columns.
    """
    library = shipped()
    features = [f for f in nominal if f is not None]
    if not features or len(features) < len(nominal):
        return None
    if replace(load(library.vehicle), name=vehicle.name) != vehicle:
        return None
    return library if library.lies_as_nominal(library.coordinates(np.array(features))) else None
