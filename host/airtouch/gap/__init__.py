"""Where the gap between simulation and reality lies, which effect causes it, how far it shrinks.

`airtouch.gap.diagnose(flights, vehicle, baseline)`, `airtouch.gap.measure(...)` and `airtouch.gap.plots(result)` are
those of `airtouch.api`, which take files, logs or tables. Those of the modules `diagnosis` and `measurement` take logs
alone.

One folder a step, the first step last; each imports only those below it. The decisions, file by file:
host/docs/architecture.md.

sealed      sets whose effect is withheld: made, diagnosed, scored
balance     flights without a gyro: the balance of a hover
answer      verdict, probabilities, parameters, how far, what to fly next
where       the map of the gap by channel, band, phase and regime
nominal     what the baseline flights say: vehicle, floor, scatter
naming      which effects are named
relations   these numbers compared with those of simulated flights of each effect
features    what a flight's signals do to one another, in numbers
nameless    what no effect explains: the nameless model, "a model without names" in answers
passing     passing effects: when they act
evidence    how likely flights are under effects, and the fit of effects to them
signals     what is compared, channel by channel: residuals, spectra, floors
loop        the closed loop: what noise, set-points and torques make of the commands
edges       what flights do at the edges of a platform
signatures  what is known of each effect, and how strong it seems in nominal flights
flights     a log made ready: on a regular clock, attitude and heights, moments of contact

`diagnosis` calls them all and fills a `result`; `measurement` is the map alone. A `study` holds what flights are
compared with: folders from `evidence` on take it. A `workspace` keeps what is worked out once; `second_process` shares
work with another core.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from airtouch.api import diagnose, measure, plots

__all__ = ["diagnose", "measure", "plots"]

if not TYPE_CHECKING:  # so that a type checker tells a name that is not there
    def __getattr__(name: str) -> Any:
        """The functions, whose modules are imported at their first use."""
        if name in __all__:
            return getattr(importlib.import_module("airtouch.api"), name)
        raise AttributeError(f"module 'airtouch.gap' has no attribute {name!r}")
