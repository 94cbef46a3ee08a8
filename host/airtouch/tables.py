"""Reading of TOML tables: every value that is not what its key needs is an AirTouchError with its place."""

import math
import tomllib
from collections.abc import Mapping, Sequence
from typing import Any, TypeGuard

from airtouch.errors import AirTouchError

LARGEST = 1e100  #: size of a number; chosen so that products of three stay finite


def parse(text: str, source: str) -> dict[str, Any]:
    """The table in a TOML text. `source` names it in messages."""
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # of ValueError also a whole number of thousands of digits
        raise AirTouchError(f"{source}: not valid TOML: {error}") from None


def is_number(value: object) -> TypeGuard[float]:
    """Whether a value is a finite number, not larger than LARGEST, and no truth value."""
    return isinstance(value, (int, float)) and not isinstance(value, bool) and -LARGEST <= value <= LARGEST


def number(table: Mapping[str, Any], key: str, where: str, low: float = -math.inf, *, above: float = -math.inf,
           default: float | None = None) -> float:
    """The number under a key, else the default; at least `low` and more than `above`.

    Raises AirTouchError that begins with `where`.
    """
    value = table.get(key, default)
    if not is_number(value):
        raise AirTouchError(f"{where}: {key} must be a number")
    if not (value >= low and value > above):
        least = f"{low:g} or more" if low > above else "positive" if above == 0.0 else f"more than {above:g}"
        raise AirTouchError(f"{where}: {key} = {value:g} must be {least}")
    return float(value)


def number_list(table: Mapping[str, Any], key: str, where: str, count: int, *, above: float = -math.inf,
                default: Sequence[float] | None = None) -> tuple[float, ...]:
    """The list of `count` numbers under a key, else the default, each more than `above`. Raises as `number` does."""
    value = table.get(key, default)
    if not (isinstance(value, (list, tuple)) and len(value) == count and all(map(is_number, value))):
        raise AirTouchError(f"{where}: {key} must be {count} numbers")
    return tuple(number({key: one}, key, where, above=above) for one in value)


def inner_table(table: Mapping[str, Any], key: str, where: str) -> dict[str, Any]:
    """The table under a key, empty where it is not there. Raises as `number` does."""
    value = table.get(key, {})
    if not isinstance(value, dict):
        raise AirTouchError(f"{where}: {key} must be a table, [{key}]")
    return value


def table_list(table: Mapping[str, Any], key: str, where: str) -> list[dict[str, Any]]:
    """The list of tables under a key, empty where it is not there. Raises as `number` does."""
    value = table.get(key, [])
    if not (isinstance(value, list) and all(isinstance(one, dict) for one in value)):
        raise AirTouchError(f"{where}: {key} must be a list of tables, [[{key}]]")
    return value
