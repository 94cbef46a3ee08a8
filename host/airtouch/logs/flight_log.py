"""The flight log: one schema for real and simulated flights."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from airtouch.errors import AirTouchError

AXES = ("x", "y", "z")
ACC = tuple(f"acc_{a}_mps2" for a in AXES)  #: body specific force, +g at rest
ACC_WORLD = tuple(f"acc_world_{a}_mps2" for a in AXES)  #: the same force in world axes
GYRO = tuple(f"gyro_{a}_radps" for a in AXES)
PWM = tuple(f"m{i}_pwm" for i in range(1, 5))  #: 0..65535
RANGES = tuple(f"range_{d}_m" for d in ("front", "back", "left", "right"))
POSITION = tuple(f"{a}_m" for a in AXES)
VELOCITY = tuple(f"v{a}_mps" for a in AXES)
ATTITUDE = ("roll_rad", "pitch_rad", "yaw_rad")
RPM = tuple(f"rpm_{i}" for i in range(1, 5))

LARGEST_BYTES = 1 << 30  #: bytes of an unpacked log; a larger file is refused
#: The columns of the schema, in the order in which they are written.
COLUMNS = (
    ("t_s",) + ACC + GYRO + PWM + ("zrange_m",) + RANGES + ("vbat_V",)
    + POSITION + VELOCITY + ATTITUDE + RPM + ACC_WORLD
)


@dataclass
class FlightLog:
    """A flight: float64 columns of equal length, (n,), and metadata.

    Units are in the column names (SI, PWM 0..65535). Body axes: x forward,
    y left, z up; motors 1 front right, 2 rear right, 3 rear left, 4 front left.
    Missing columns are absent, missing samples are NaN.

    `meta` holds at least `source` (file name) and `format`; readers add
    `vehicle`, `condition`, `acc_frame` ("body" or "world": the axes that the
    `acc_*` columns are really in) and `warnings` (list of str).
    """

    columns: dict[str, np.ndarray]
    meta: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.columns = {k: np.asarray(v, dtype=np.float64) for k, v in self.columns.items()}
        shapes = {name: values.shape for name, values in self.columns.items()}
        if len(set(shapes.values())) > 1 or any(len(shape) != 1 for shape in shapes.values()):
            raise AirTouchError(f"{self.source}: columns of unequal length: {shapes}; give each one value a sample")

    def __len__(self) -> int:
        return len(next(iter(self.columns.values()), ()))

    def __getitem__(self, name: str) -> np.ndarray:
        self.require(name)
        return self.columns[name]

    @property
    def source(self) -> str:
        """The name of its file, for messages."""
        return str(self.meta.get("source", "flight log"))

    def has(self, *names: str) -> bool:
        """True if all of the named columns are there."""
        return all(name in self.columns for name in names)

    def require(self, *names: str) -> None:
        """Raise AirTouchError with the names of the missing columns, if any is missing."""
        missing = [name for name in names if name not in self.columns]
        if missing:
            raise AirTouchError(f"{self.source}: no column {', '.join(missing)} in this log; log it too")

    def stack(self, names: Iterable[str]) -> np.ndarray:
        """The named columns as an array (samples, columns)."""
        names = tuple(names)
        self.require(*names)
        return np.column_stack([self.columns[name] for name in names])

    def slice(self, start: int, stop: int) -> "FlightLog":
        """The flight log of samples start to stop - 1."""
        return FlightLog({k: v[start:stop] for k, v in self.columns.items()}, dict(self.meta))

    def with_columns(self, columns: Mapping[str, np.ndarray], **meta: Any) -> "FlightLog":
        """A copy with these columns and metadata added or replaced."""
        return FlightLog({**self.columns, **columns}, {**self.meta, **meta})
