"""Every effect that can be switched on: one file each, one registry.

`EFFECTS` maps names to effects in the order in which they are applied. `register` adds
one of your own; `load_file` registers those of a Python file.
"""

import dataclasses
import importlib
import re
import sys
import traceback
from collections.abc import Iterable, Mapping
from pathlib import Path

from airtouch.errors import AirTouchError, nearest, unknown
from airtouch.logs.files import read_text
from airtouch.simulation.effects import names
from airtouch.simulation.effects.effect import Active, Effect, Parameter, wrench

__all__ = ["EFFECTS", "Active", "Effect", "Parameter", "activate", "get", "load_file", "load_text", "parse",
           "register",
           "source_of", "unregister", "wrench"]

#: Effects in the order in which they are applied, and the folder of each one's file
FOLDER_OF = {
    "ground_effect": "air", "rotor_drag": "air", "wind": "air", "gust": "air", "blade_flapping": "air",
    "motor_lag": "motors", "motor_noise": "motors", "thrust_coefficient": "motors", "weak_motor": "motors",
    "battery_sag": "motors",
    "mass": "body", "com_offset": "body", "inertia": "body", "slung_load": "body",
    "imu_bias": "sensing", "imu_noise": "sensing", "vibration": "sensing", "sensor_latency": "sensing",
    "actuator_delay": "motors",
    "time_jitter": "logging", "packet_loss": "logging",
    "range_step": "sensing", "range_bias": "sensing", "flow_scale": "sensing", "flow_latency": "sensing",
    "controller_gain": "sensing",
    "downwash": "air",
}
NAMES = tuple(FOLDER_OF)
EFFECTS: dict[str, Effect] = {
    name: importlib.import_module(f"airtouch.simulation.effects.{folder}.{name}").EFFECT
    for name, folder in FOLDER_OF.items()}


def register(effect: Effect) -> Effect:
    """Add an effect of your own; raises AirTouchError when its name is taken."""
    if effect.name in EFFECTS:
        raise AirTouchError(f"an effect named {effect.name!r} is already there")
    EFFECTS[effect.name] = effect
    return effect


def unregister(name: str) -> None:
    """Take an effect out (the diagnosis is tested on effects that it does not know)."""
    get(name)
    del EFFECTS[name]
    _SOURCE.pop(name, None)
    for key in [k for k, loaded in _LOADED.items() if any(e.name == name for e in loaded)]:
        del _LOADED[key]


def get(name: str) -> Effect:
    """The effect of that name; AirTouchError names the known ones."""
    if name not in EFFECTS:
        raise unknown("effect", name, EFFECTS)
    return EFFECTS[name]


def activate(chosen: Iterable[Active | tuple[str, Mapping[str, float]]] | Mapping[str, Mapping[str, float]],
             ) -> list[Active]:
    """Effects with all their values, in the registry's order (so that the order given does not matter).

    chosen: {name: {parameter: value}}, or pairs of both where one effect comes twice.
    Raises AirTouchError for unknown names, values out of bounds, and a second one of an effect that can be on once.
    """
    if isinstance(chosen, Mapping):
        chosen = list(chosen.items())
    active = []
    for item in chosen:
        if not isinstance(item, Active):
            effect = get(item[0])
            item = Active(effect, effect.values(item[1]))
        if item.effect.once and any(a.effect.name == item.effect.name for a in active):
            raise AirTouchError(f"{item.effect.name} is given twice; a second one would only replace the first")
        active.append(item)
    order = {name: i for i, name in enumerate(EFFECTS)}
    return sorted(active, key=lambda a: order.get(a.effect.name, len(order)))


_QUANTITY = re.compile(r"^([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*)$")


def parse(text: str) -> tuple[str, dict[str, float]]:
    """`name:parameter=value unit,...` as on the command line, to a name and its values.

    Every value carries the parameter's unit, as in `wind:x=0.3m/s`; pure numbers carry none.
    `preset=NAME` takes values that were measured together.
    Raises AirTouchError that says what was expected.
    """
    name, _, rest = text.partition(":")
    effect = get(name.strip())
    units = {p.name: p.unit for p in effect.parameters}
    chosen: dict[str, float | str] = {}
    for part in filter(None, (p.strip() for p in rest.split(","))):
        key, equals, quantity = (piece.strip() for piece in part.partition("="))
        if key in chosen:
            raise AirTouchError(f"{text!r}: {key} is given twice")
        if key == "preset" and equals:
            chosen[key] = quantity
            continue
        match = _QUANTITY.match(quantity)
        if not equals or not match:
            raise AirTouchError(f"{text!r}: write {effect.name}:parameter=value with its unit")
        if key not in units:
            raise AirTouchError(f"{effect.name} has no parameter {key!r}; it has {', '.join(units)}")
        unit = match.group(2).replace(" ", "")
        expected = units[key].replace(" ", "")
        if unit not in (("",) if expected == "1" else (expected, expected.removeprefix("1"))):  # 0.3/s is 0.3 1/s
            want = "no unit" if expected == "1" else f"the unit {units[key]}"
            raise AirTouchError(f"{effect.name}: {key}={quantity} needs {want}")
        chosen[key] = float(match.group(1))
    return effect.name, effect.values(chosen)


def load_file(path: str | Path) -> list[Effect]:
    """Register every `Effect` that a Python file defines at its top level, and return them.

    Raises AirTouchError for a file that is not there or no text.
    """
    if not Path(path).is_file():
        raise AirTouchError(f"{path}: no such file of effects")
    loaded = load_text(read_text(path), str(path))
    _SOURCE.update(dict.fromkeys((e.name for e in loaded), str(path)))
    return loaded


def load_text(text: str, source: str = "effect file") -> list[Effect]:
    """Register the effects of Python source; a second time with the same text changes nothing."""
    key = hash(text)
    if key in _LOADED:
        return _LOADED[key]
    scope: dict[str, object] = {"__name__": "airtouch_effects"}
    try:
        names.check(text, source)
        exec(compile(text, source, "exec"), scope)
    except AirTouchError:
        raise
    except Exception as error:
        raise AirTouchError(f"{source}{_line_of(error, source)}: {_in_words(error)}") from None
    defined = [v for v in scope.values() if isinstance(v, Effect)]
    if not defined:
        raise AirTouchError(f"{source}: defines no Effect")
    names_of_file = [e.name for e in defined]
    for name in names_of_file:
        if name in EFFECTS or names_of_file.count(name) > 1:
            raise AirTouchError(f"{source}: an effect named {name!r} is already there; give yours another name")
    _LOADED[key] = [register(e) for e in defined]
    return _LOADED[key]


def source_of(name: str) -> str:
    """The file that an effect of a user's own was loaded from, "" for one of the package."""
    return _SOURCE.get(name, "")


def _in_words(error: Exception) -> str:
    """The error in a line, with the nearest right names where a name was wrong."""
    text = str(error).splitlines()[0]
    if missing := re.match(r"cannot import name '(\w+)' from '([\w.]+)'", text):
        name, module = missing.groups()
        return f"{module} has no {name!r}{nearest(name, vars(sys.modules[module]))}"
    if argument := re.match(r"(\w+)\.__init__\(\) got an unexpected keyword argument '(\w+)'", text):
        kind, name = argument.groups()
        known = {"Effect": Effect, "Parameter": Parameter}.get(kind)
        if known:
            return f"{kind} takes no {name!r}{nearest(name, [f.name for f in dataclasses.fields(known)])}"
    return f"{type(error).__name__}: {text}"


def _line_of(error: Exception, source: str) -> str:
    """`:12`, the line of the file in which an error was raised, "" where it is not known."""
    if isinstance(error, SyntaxError):
        return f":{error.lineno}" if error.lineno else ""
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == source]
    return f":{lines[-1]}" if lines else ""


_LOADED: dict[int, list[Effect]] = {}
_SOURCE: dict[str, str] = {}
