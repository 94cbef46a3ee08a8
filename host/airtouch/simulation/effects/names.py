"""Names that an effect file uses, checked before numba sees them.

A wrong one is told with its line and what is near.
"""

import ast
import operator
from collections.abc import Iterator, Mapping

from airtouch.errors import AirTouchError, nearest
from airtouch.simulation import plant, signals
from airtouch.simulation.effects.effect import MEMORY, PARAMETERS

SIGNALS = tuple(name for name in vars(signals) if name.isupper() and name != "COUNT")
OPERATIONS = {ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul}
FIELDS = tuple(name for name, *_ in plant.FIELDS)


def check(text: str, source: str) -> None:
    """Raise AirTouchError for a signal, plant field or parameter that there is not, and for a place outside its array.

    It reads `file:line: ...; did you mean ...`. Checked are places that numbers, whole-number constants of the file
    and signals give, also their sums, differences and products; one that is computed in flight is not.
    """
    tree = ast.parse(text, source)
    known = set(_signal_modules(tree))
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in known:
            _check(node.attr, SIGNALS, "signal", source, node.lineno)
    parameters = _parameters(tree)
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
    numbers = dict(_whole_numbers(tree))
    for function in _wrenches(tree):
        _check_places(function, len(parameters), numbers, known, source)


def _check_places(function: ast.FunctionDef, parameters: int, numbers: Mapping[str, int], known: set[str],
                  source: str) -> None:
    """Raise AirTouchError where a wrench names a place that its array lacks: compiled code does not look.

    numbers: the file's whole-number constants. known: names of the module of signals.
    """
    values, signal, memory, _, wrench = (a.arg for a in function.args.args)
    places = {values: parameters or PARAMETERS, signal: signals.COUNT, memory: MEMORY, wrench: 6}
    own = {node.id for node in ast.walk(function) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
    constants = {name: value for name, value in numbers.items() if name not in own}
    for node in ast.walk(function):
        if isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name) and node.value.id in places:
            name, size = node.value.id, places[node.value.id]
            place = _value(node.slice, constants, known)
            if place is not None and not (0 if name == values else -size) <= place < size:  # p is longer than it seems
                raise AirTouchError(f"{source}:{node.lineno}: {ast.unparse(node)} does not exist; "
                                    f"the last place is {name}[{size - 1}]")


def _value(node: ast.AST, constants: Mapping[str, int], known: set[str]) -> int | None:
    """The whole number that an expression gives before the flight; None if there is none."""
    if isinstance(node, ast.Constant):
        return node.value if isinstance(node.value, int) else None
    if isinstance(node, ast.Name):
        return constants.get(node.id)
    if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in known:
        return getattr(signals, node.attr, None)
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        value = _value(node.operand, constants, known)
        return None if value is None else -value
    if isinstance(node, ast.BinOp) and type(node.op) in OPERATIONS:
        left, right = _value(node.left, constants, known), _value(node.right, constants, known)
        return None if left is None or right is None else OPERATIONS[type(node.op)](left, right)
    return None


def _whole_numbers(tree: ast.Module) -> Iterator[tuple[str, int]]:
    """Names and values of the file's whole-number constants: `A = 3` and `A, B = 0, 1` or `A, B = range(2)`."""
    for node in tree.body:
        if not isinstance(node, ast.Assign):
            continue
        for target in node.targets:
            names, values = [target], [node.value]
            if isinstance(target, ast.Tuple):
                names = target.elts
                values = node.value.elts if isinstance(node.value, ast.Tuple) else _range(node.value)
            for name, value in zip(names, values, strict=False):
                number = _value(value, {}, set())
                if isinstance(name, ast.Name) and number is not None:
                    yield name.id, number


def _range(node: ast.expr) -> list[ast.expr]:
    """The elements of `range(stop)` and `range(start, stop)`; none of anything else."""
    if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "range"):
        return []
    bounds = [_value(argument, {}, set()) for argument in node.args]
    if not 1 <= len(bounds) <= 2 or None in bounds:
        return []
    return [ast.Constant(i) for i in range(*(b for b in bounds if b is not None))]


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


def _parameters(tree: ast.Module) -> tuple[str, ...]:
    """Names of the parameters that the file declares; none if one of them is computed, for then they are not known."""
    names = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "Parameter":
            name = node.args[0] if node.args else next((k.value for k in node.keywords if k.arg == "name"), None)
            if not (isinstance(name, ast.Constant) and isinstance(name.value, str)):
                return ()
            names.append(name.value)
    return tuple(names)


def _settings(tree: ast.Module) -> Iterator[ast.FunctionDef]:
    """Functions that are given to an Effect as its settings."""
    used = {k.value.id for node in ast.walk(tree) if isinstance(node, ast.Call) for k in node.keywords
            if k.arg == "settings" and isinstance(k.value, ast.Name)}
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and node.name in used and len(node.args.args) >= 2:
            yield node
