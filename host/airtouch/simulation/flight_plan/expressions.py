"""Values of a scenario: numbers, ranges to draw from, and small sums over named values."""

import ast
import functools
import math
import operator
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.tables import is_number

_BINARY = {ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv}
_FUNCTIONS: dict[str, Callable[..., float]] = {
    "sin": lambda d: math.sin(math.radians(d)), "cos": lambda d: math.cos(math.radians(d)), "max": max, "min": min}


def draw(node: Any, values: Mapping[str, Any], rng: np.random.Generator, where: str) -> Any:
    """One value, drawn if need be, for a node of a scenario.

    {low, high}: uniform; {choice = [...]}: one of them; "= sum": arithmetic over `values`
    with sin, cos (degrees), min and max; lists and tables: element by element; anything
    else: itself. Raises AirTouchError that begins with `where`.
    """
    if isinstance(node, str) and node.startswith("="):
        return evaluate(node[1:], values, where)
    if isinstance(node, list):
        return [draw(item, values, rng, where) for item in node]
    if isinstance(node, dict):
        if set(node) == {"low", "high"}:
            low, high = (draw(node[k], values, rng, where) for k in ("low", "high"))
            if not (is_number(low) and is_number(high) and low <= high):
                raise AirTouchError(f"{where}: a range needs two numbers, low <= high")
            return float(rng.uniform(low, high))
        if set(node) == {"choice"}:
            if not isinstance(node["choice"], list) or not node["choice"]:
                raise AirTouchError(f"{where}: choice needs a list")
            return draw(node["choice"][int(rng.integers(len(node["choice"])))], values, rng, where)
        return {key: draw(item, values, rng, f"{where}.{key}") for key, item in node.items()}
    return node


def evaluate(text: str, values: Mapping[str, Any], where: str) -> float:
    """The value of an arithmetic expression over named values."""
    try:
        return float(_evaluate(_tree(text.strip()), values))
    except KeyError as error:
        name = error.args[0]
        raise AirTouchError(f"{where}: {text.strip()!r} uses {name!r}, "
                            "which [values] does not have") from None
    except (SyntaxError, TypeError, ValueError, ArithmeticError, RecursionError, MemoryError):
        raise AirTouchError(f"{where}: {text.strip()!r} is not a sum of numbers and named values") from None


@functools.lru_cache(maxsize=1000)
def _tree(text: str) -> ast.expr:
    return ast.parse(text, mode="eval").body


def _evaluate(node: ast.expr, values: Mapping[str, Any]) -> float:
    if isinstance(node, ast.Constant) and is_number(node.value):
        return node.value
    if isinstance(node, ast.Name):
        if not is_number(values[node.id]):
            raise ValueError
        return values[node.id]
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        return -_evaluate(node.operand, values)
    if isinstance(node, ast.BinOp) and type(node.op) in _BINARY:
        return _BINARY[type(node.op)](_evaluate(node.left, values), _evaluate(node.right, values))
    if (isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in _FUNCTIONS
            and not node.keywords):
        return _FUNCTIONS[node.func.id](*(_evaluate(a, values) for a in node.args))
    raise ValueError
