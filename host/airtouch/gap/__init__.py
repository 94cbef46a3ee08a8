"""Where the gap between simulation and reality lies, which effect causes it, how far it shrinks.

`airtouch.gap.diagnose(flights, vehicle, baseline)` and `airtouch.gap.measure(...)` take files, logs or tables, as
`airtouch.api` says. Both are modules as well, whose functions take logs alone.

Where each decision is made:

- A log made ready: `flight`, `motion`; what is compared: `channels`, `spectra`, `data`.
- Where the gap lies: `measure`, with `band_sums`, `cell_tables`, `gap_map`, `summary`.
- What is normal: `calibrate` (the vehicle), `response`, `hardness` and `lost_rows` (the floor), `twin`, `twin_view`,
  `controller`, `loop_model` and `edge_response` (the closed loop), `nominal_scatter` and `apparent` (how strong
  effects seem to be where there are none).
- Which effect: `diagnose` calls `select`, which adds effects one by one. `candidates` says how each effect is
  fitted, `screen` takes a first look, `judging` fits on one half and judges on the other by `fit`, `problem`,
  `least_squares`, `random_effects` and `vibration_lines`; `gates` finds what comes and goes, `clock` what only the
  log's times show, `generic` with `basis` what has no name. `selection` holds what was found, with its
  probabilities.
- How far: `shrink`. What stays open: `unexplained`. What to fly next: `advice`.
- Flights without a gyro: `hover_balance`, `balance_result`.
- The answer: `result`, `words`, `pictures`.
- Withheld effects: `blind`, with `blind_draw`, `blind_run`, `blind_score`, `blind_severity`; on a cluster:
  `on_cluster`.
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
