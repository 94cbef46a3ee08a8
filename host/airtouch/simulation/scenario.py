"""Scenarios: a world, a mission and effects with ranges, so that no two flights are alike."""

import math
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

import numpy as np

from airtouch import tables
from airtouch.errors import AirTouchError, unknown
from airtouch.simulation import effects
from airtouch.simulation.firmware.settings import DEFAULT
from airtouch.simulation.flight_plan import mission, world
from airtouch.simulation.flight_plan.expressions import draw
from airtouch.vehicle import RANGE_MODULES, Vehicle, check_firmware, numbers

KEYS = {"name", "summary", "firmware", "range_module", "vehicle", "values", "world", "platform", "mission", "effects"}
SCENARIOS = resources.files("airtouch") / "simulation" / "scenarios"
MISSIONS = resources.files("airtouch") / "crazyflie" / "missions"  #: scenarios that `airtouch collect` flies too
FIRMWARE_KEYS = ("firmware", "range_module")  #: fields of a vehicle that may stand outside [vehicle]
#: x from, to, y from, to: walls out of the reach (4 m) of the ranging sensors
DEFAULT_ROOM_M = (-10.0, 10.0, -10.0, 10.0)
CIRCLE_CORNERS = 24  #: a polygon of so many corners is within 0.9 % of the radius of its circle


@dataclass(frozen=True)
class Scenario:
    """A parsed scenario file; `draw_flight` makes one flight of it."""

    name: str
    summary: str
    table: Mapping[str, Any]


@dataclass(frozen=True)
class FlightPlan:
    """One flight with every value drawn: set-points (rows, 8), world, room (4,), effects.

    changes: fields of the vehicle that are others in this flight, firmware and range module among them.
    """

    setpoints: np.ndarray
    world: world.World
    room: np.ndarray
    effects: list[tuple[str, dict[str, float]]]
    values: dict[str, Any]
    changes: Mapping[str, Any] = field(default_factory=dict)

    def with_changes(self, vehicle: Vehicle) -> Vehicle:
        """The vehicle of this flight: the declared one with the flight's own values."""
        return replace(vehicle, **self.changes)


def names(folder: Traversable = SCENARIOS) -> list[str]:
    """Names of the package's scenarios, or of its missions: folder is SCENARIOS or MISSIONS."""
    return sorted(f.name[:-5] for f in folder.iterdir() if f.name.endswith(".toml"))


def load(name_or_path: str | Path) -> Scenario:
    """A built-in scenario or mission by name, or a TOML file by path. Raises AirTouchError in one line."""
    if not isinstance(name_or_path, (str, Path)):
        raise AirTouchError(f"a scenario is a name, a .toml file or an object, not {name_or_path!r}")
    path = Path(name_or_path)
    if path.suffix == ".toml":
        if not path.is_file():
            raise AirTouchError(f"{path}: no such scenario file")
        text = path.read_text(encoding="utf-8", errors="replace")
    else:
        folders = {name: folder for folder in (SCENARIOS, MISSIONS) for name in names(folder)}
        if str(name_or_path) not in folders:
            raise unknown("scenario", str(name_or_path), folders, ", or a .toml file")
        text = (folders[str(name_or_path)] / f"{name_or_path}.toml").read_text(encoding="utf-8")
    return parse(text, str(name_or_path))


def parse(text: str, source: str) -> Scenario:
    """A scenario from TOML text; `source` names it in messages. One flight is drawn as a check."""
    table = tables.parse(text, source)
    unknown_keys = sorted(set(table) - KEYS)
    if unknown_keys:
        raise AirTouchError(f"{source}: unknown key {', '.join(unknown_keys)}; known: {', '.join(sorted(KEYS))}")
    for key in FIRMWARE_KEYS:
        if not isinstance(table.get(key, ""), str):
            raise AirTouchError(f"{source}: {key} must be a text in quotes")
    if "mission" not in table:
        raise AirTouchError(f"{source}: no [mission]")
    name = str(table.get("name", Path(source).stem))
    if not (Path(name).name and name.isprintable()):
        raise AirTouchError(f"{source}: name = {name!r} must be printable text that files can be named by")
    scenario = Scenario(name, str(table.get("summary", "")), table)
    try:
        changes = draw_flight(scenario, 0, 0).changes
    except RecursionError:
        raise AirTouchError(f"{source}: lists and tables are nested too deeply") from None
    check_firmware(changes.get("firmware", DEFAULT), changes.get("range_module", RANGE_MODULES[0]), source)
    return scenario


def draw_flight(scenario: Scenario, seed: int, flight: int) -> FlightPlan:
    """Draw flight number `flight`. The result depends on (scenario, seed, flight) only.

    Raises AirTouchError when what is drawn cannot be flown.
    """
    rng = np.random.default_rng([seed, flight, zlib.crc32(b"scenario")])
    source, table = scenario.name, scenario.table
    values: dict[str, Any] = {}
    for key, node in tables.inner_table(table, "values", source).items():
        value = draw(node, values, rng, f"{source}: values.{key}")
        values |= value if isinstance(value, dict) else {key: value}  # a table: values that are drawn together
    ground = _drawn(table, "world", values, rng, source)
    platforms = [_platform(draw(p, values, rng, f"{source}: platform {i + 1}"), f"{source}: platform {i + 1}")
                 for i, p in enumerate(tables.table_list(table, "platform", source))]
    if set(ground) - {"floor", "room_m"}:
        raise AirTouchError(f"{source}: [world] takes floor and room_m")
    built = world.build(platforms, str(ground.get("floor", "cement")))
    chosen = []
    for name, drawn in _drawn(table, "effects", values, rng, source).items():
        effect = effects.get(name)
        for one in drawn if isinstance(drawn, list) else [drawn]:
            if not isinstance(one, dict):
                raise AirTouchError(f"{source}: effects.{name} must be a table of its parameters")
            chosen.append((name, effect.values(one)))
    plan = _drawn(table, "mission", values, rng, source)
    rows = mission.setpoints(plan, built, source)
    room = np.array(tables.number_list(ground, "room_m", source, 4, default=DEFAULT_ROOM_M))
    if room[0] >= room[1] or room[2] >= room[3]:
        raise AirTouchError(f"{source}: room_m is x from, to, y from, to: each from must be below its to")
    fields = _drawn(table, "vehicle", values, rng, source)
    changes = numbers(fields, f"{source}: [vehicle]") | {k: table[k] for k in FIRMWARE_KEYS if table.get(k)}
    if "name" in changes:
        raise AirTouchError(f"{source}: [vehicle] takes every field of a vehicle but its name")
    return FlightPlan(rows, built, room, chosen, values, changes)


def _drawn(table: Mapping[str, Any], key: str, values: Mapping[str, Any], rng: np.random.Generator,
           source: str) -> dict[str, Any]:
    """The table under a key with every value drawn."""
    drawn = {key: draw(tables.inner_table(table, key, source), values, rng, f"{source}: {key}")}
    return tables.inner_table(drawn, key, source)


def _platform(table: Mapping[str, Any], where: str) -> world.Platform:
    """A platform from its table: shape rectangle (size_m), circle (radius_m) or polygon (corners_m)."""
    if not isinstance(table, Mapping):
        raise AirTouchError(f"{where}: must be a table")
    shape = table.get("shape", "rectangle")
    needed = {"rectangle": {"size_m"}, "circle": {"radius_m"}, "polygon": {"corners_m"}}
    if not isinstance(shape, str) or shape not in needed:
        raise AirTouchError(f"{where}: no shape {shape!r}; known: {', '.join(needed)}")
    wrong = set(table) - needed[shape] - {"shape", "centre_m", "angle_deg", "top_m", "material"}
    missing = (needed[shape] | {"top_m"}) - set(table)
    if wrong or missing:
        fault = f"does not take {', '.join(sorted(wrong))}" if wrong else f"needs {', '.join(sorted(missing))}"
        raise AirTouchError(f"{where}: a {shape} {fault}")
    top = tables.number(table, "top_m", where, 0.0)
    if shape == "rectangle":
        half = np.array(tables.number_list(table, "size_m", where, 2, above=0.0)) / 2.0
        corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * half
    elif shape == "circle":
        turn = np.arange(CIRCLE_CORNERS) * 2.0 * np.pi / CIRCLE_CORNERS
        corners = tables.number(table, "radius_m", where, above=0.0) * np.column_stack([np.cos(turn), np.sin(turn)])
    else:
        if not isinstance(table["corners_m"], list) or len(table["corners_m"]) < 3:
            raise AirTouchError(f"{where}: corners_m needs three corners or more, each of two numbers")
        corners = np.array([tables.number_list({"corners_m": pair}, "corners_m", where, 2)
                            for pair in table["corners_m"]])
    angle = math.radians(tables.number(table, "angle_deg", where, default=0.0))
    turn = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
    corners = corners @ turn + np.array(tables.number_list(table, "centre_m", where, 2, default=(0.0, 0.0)))
    return world.Platform(corners, top, str(table.get("material", "acrylic")))
