"""A twin as files that `airtouch simulate` and `airtouch gap` take: vehicle.toml and scenario.toml."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from airtouch import vehicle as vehicles
from airtouch.logs.files import write_bytes
from airtouch.simulation import scenario
from airtouch.twin.fitting import levers as lever_set
from airtouch.twin.fitting.levers import Lever
from airtouch.twin.recorded import missions
from airtouch.twin.recorded.course import Course
from airtouch.vehicle import Vehicle

VEHICLE, SCENARIO = "vehicle.toml", "scenario.toml"  #: names of the files


def vehicle_text(vehicle: Vehicle) -> str:
    """A vehicle as TOML that `vehicle.load` reads back as the same."""
    values = {name: list(value) if isinstance(value, tuple) else value
              for name, value in asdict(vehicle).items() if value is not None}
    return tomli_w.dumps(values)


def scenario_text(courses: Sequence[Course], effects: Mapping[str, Any], name: str,
                  **mission: float) -> str:
    """A scenario as TOML: each flight draws one of the courses. mission: as of `missions.course_values`."""
    return tomli_w.dumps(missions.table(courses, effects, name, **mission))


def write(out: Path, vehicle: Vehicle, levers: Sequence[Lever], values: np.ndarray, courses: Sequence[Course],
          fixed: Mapping[str, Any] | None = None, *, name: str = missions.NAME,
          force: bool = False) -> tuple[Path, Path]:
    """Write both files into a folder; each is read back as a check.

    values: (levers,). fixed: effects without levers. Raises AirTouchError for a file that exists, without `force`.
    """
    craft = replace(lever_set.craft(vehicle, levers, values), name=name)
    texts = {VEHICLE: vehicle_text(craft),
             SCENARIO: scenario_text(courses, lever_set.table(levers, values, fixed), name,
                                     **lever_set.mission(levers, values))}
    vehicles.parse(texts[VEHICLE], VEHICLE)
    scenario.parse(texts[SCENARIO], SCENARIO)
    for file, text in texts.items():
        write_bytes(text.encode(), out / file, force)
    return out / VEHICLE, out / SCENARIO
