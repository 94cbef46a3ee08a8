"""An effect as the command line writes it: `name:parameter=value unit,...`."""

import re

from airtouch.errors import AirTouchError
from airtouch.simulation.effects.registry import get

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
