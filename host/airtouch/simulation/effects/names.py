"""Names that an effect file uses, checked before numba sees them.

A wrong one is told with its line and what is near.
"""

import ast
from collections.abc import Iterator

from airtouch.errors import AirTouchError, nearest
from airtouch.simulation import plant, signals
from airtouch.simulation.effects.effect import MEMORY, PARAMETERS

SIGNALS = tuple(name for name in vars(signals) if name.isupper())
FIELDS = tuple(name for name, *_ in plant.FIELDS)


def check(text: str, source: str) -> None:
    """Raise AirTouchError for a signal, plant field or parameter that there is not, and for a place outside its array.

    It reads `file:line: ...; did you mean ...`.
    """
    tree = ast.parse(text, source)
    known = set(_signal_modules(tree))
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in known:
            _check(node.attr, SIGNALS, "signal", source, node.lineno)
    parameters = tuple(_parameters(tree))
    for function in _settings(tree):
        row, values = (a.arg for a in function.args.args[:2])
        for node in ast.walk(function):
            if not (isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name)
                    and isinstance(node.slice, ast.Constant) and isinstance(node.slice.value, str)):
                continue
            if node.value.id == row:
                _check(node.slice.value, (*FIELDS, "firmware"), "plant field", source, node.lineno)
            elif node.value.id == values and parameters:
                _check(node.slice.value, parameters, "parameter of this file", source, node.lineno)
    for function in _wrenches(tree):
        _check_places(function, len(parameters), source)


def _check_places(function: ast.FunctionDef, parameters: int, source: str) -> None:
    """Raise AirTouchError where a wrench names a place that its array lacks: compiled code does not look."""
    values, _, memory, _, out = (a.arg for a in function.args.args)
    places = {values: parameters or PARAMETERS, memory: MEMORY, out: 6}
    for node in ast.walk(function):
        if isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name) and node.value.id in places:
            last = places[node.value.id] - 1
            if isinstance(node.slice, ast.Constant) and isinstance(node.slice.value, int) and node.slice.value > last:
                raise AirTouchError(f"{source}:{node.lineno}: {node.value.id}[{node.slice.value}] does not exist; "
                                    f"the last place is {node.value.id}[{last}]")


def _wrenches(tree: ast.Module) -> Iterator[ast.FunctionDef]:
    """Functions marked with @wrench that take its five arguments."""
    for node in tree.body:
        if (isinstance(node, ast.FunctionDef) and len(node.args.args) == 5
                and any(isinstance(d, ast.Name) and d.id == "wrench" for d in node.decorator_list)):
            yield node


def _check(name: str, names: tuple[str, ...], what: str, source: str, line: int) -> None:
    if name not in names:
        raise AirTouchError(f"{source}:{line}: no {what} "
                            f"{name!r}{nearest(name, names) or '; the page on effects lists them'}")


def _signal_modules(tree: ast.Module) -> Iterator[str]:
    """Names under which the file has the module of signals."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module == "airtouch.simulation":
            yield from (a.asname or a.name for a in node.names if a.name == "signals")
        elif isinstance(node, ast.Import):
            yield from (a.asname for a in node.names if a.name == "airtouch.simulation.signals" and a.asname)


def _parameters(tree: ast.Module) -> Iterator[str]:
    """Names of the parameters that the file declares."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "Parameter" and node.args:
            first = node.args[0]
            if isinstance(first, ast.Constant):
                yield str(first.value)


def _settings(tree: ast.Module) -> Iterator[ast.FunctionDef]:
    """Functions that are given to an Effect as its settings."""
    used = {k.value.id for node in ast.walk(tree) if isinstance(node, ast.Call) for k in node.keywords
            if k.arg == "settings" and isinstance(k.value, ast.Name)}
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and node.name in used and len(node.args.args) >= 2:
            yield node
