"""Where the gap between simulation and reality lies, which effect causes it, how far it shrinks.

`airtouch.gap.diagnose(flights, vehicle, baseline)` and `airtouch.gap.measure(...)` take files, logs or tables, as
`airtouch.api` says. Both are modules as well, whose functions take logs alone.
"""

import importlib
import sys
from types import ModuleType
from typing import Any


class _Callable(ModuleType):
    """A module that is called by its own name: `gap.diagnose(...)` is `airtouch.api.diagnose(...)`."""

    def __call__(self, *arguments: Any, **options: Any) -> Any:
        return getattr(importlib.import_module("airtouch.api"), self.__name__.rpartition(".")[2])(*arguments, **options)


def callable_module(name: str) -> None:
    """Make the module of that name one that can be called."""
    sys.modules[name].__class__ = _Callable


def __getattr__(name: str) -> Any:
    if name in ("diagnose", "measure"):
        return importlib.import_module(f"airtouch.gap.{name}")
    raise AttributeError(f"module 'airtouch.gap' has no attribute {name!r}")
