"""Where the gap between simulation and reality lies, which effect causes it, how far it shrinks.

`airtouch.gap.diagnose(flights, vehicle, baseline)` and `airtouch.gap.measure(...)` take files, logs or tables, as
`airtouch.api` says. Both are modules as well, whose functions take logs alone.

One folder a step; each imports only those above it. The decisions, file by file: host/docs/architecture.md.

flights     a log made ready: on a regular clock, attitude and heights, moments of contact
signatures  what is known of each effect, and how strong it seems in nominal flights
edges       what flights do at the edges of a platform
loop        the closed loop: what noise, set-points and torques make of the commands
signals     what is compared, channel by channel, and with what: the study of a vehicle
evidence    how likely flights are under effects, and the fit of effects to them
passing     effects that come and go: when they act
unnamed     what no effect explains: a model without names
features    what a flight's signals do to one another, in numbers
relations   these numbers compared with those of simulated flights of each effect
naming      which effects are named
nominal     what the baseline flights say: vehicle, floor, scatter
where       the map of the gap by channel, band, phase and regime
answer      verdict, probabilities, parameters, how far, what to fly next
balance     flights without a gyro: the balance of a hover
sealed      sets whose effect is withheld: made, diagnosed, scored

`diagnose` calls them all and fills a `result`; `measure` is the map alone. A `workspace` keeps what is worked out once;
`second_process` shares work with another core.
"""

import importlib
import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # what a call of them takes and returns; import the modules as `import airtouch.gap.diagnose as ...`
    from airtouch.api import diagnose, measure

__all__ = ["callable_module", "diagnose", "measure"]


class _Callable(ModuleType):
    """A module that is called by its own name: `gap.diagnose(...)` is `airtouch.api.diagnose(...)`."""

    def __call__(self, *arguments: Any, **options: Any) -> Any:
        return getattr(importlib.import_module("airtouch.api"), self.__name__.rpartition(".")[2])(*arguments, **options)


def callable_module(name: str) -> None:
    """Make the module of that name one that can be called."""
    sys.modules[name].__class__ = _Callable


if not TYPE_CHECKING:  # so that a type checker tells a name that is not there
    def __getattr__(name: str) -> Any:
        if name in ("diagnose", "measure"):
            return importlib.import_module(f"airtouch.gap.{name}")
        raise AttributeError(f"module 'airtouch.gap' has no attribute {name!r}")
