"""Where the gap between simulation and reality lies, which effect causes it, how far it shrinks.

`airtouch.gap.diagnose(flights, vehicle, baseline)` and `airtouch.gap.measure(...)` take files, logs or tables, as
`airtouch.api` says. Both are modules as well, whose functions take logs alone.

Where each decision is made; a folder imports only those above it:

- `flights`, a log made ready: a `flight`, where it has the `fitness`, on a regular `clock`, without `missing` samples
  and moments of `contact`; its `attitude` and `heights`, by `filters`; its `blocks`; how hard it is flown: `hardness`.
- `signatures`, what is known of each effect: its `signature` says how it is fitted and where it shows, as a `term` of a
  hypothesis, of which `candidates` has all; names `alike`; `scatter` says how strong it seems where there is none, by
  `scatter_estimates` (a `posterior` of the baseline flights), `random_draws` how simulated flights with it are drawn.
- `edges`, what flights do at the edges of a platform: the `edge_response`, and what `edge_effects` add to it.
- `loop`, the closed loop: `axis_plant` and `controller`, their transfer functions `loop_model`; what noise makes of the
  commands, `noise_spectra`, and steps of a set-point, `set_point_steps`; how the vehicle turns upon a command,
  `command_response`, and what part of its torque that is, `torque_share`; what a torque from outside leaves:
  `disturbed`; `command_spectra` of flights, from which `identify` finds a `closed_loop`.
- `signals`, what is compared: `channels`, `spectra`, `command_view`, with what: a `study`; what raises the floor:
  `response`, `lost_rows`.
- `evidence`, how likely the flights are under an effect: `data`, of which a `problem` has the blocks in one flat array
  (their `layout`, their `cells`), its `likelihood`; `fit` with `gauss_newton`, `slopes`, `least_squares`,
  `random_effects` and `vibration_lines`; `clock`, what only the log's times show.
- `passing`, what comes and goes: `gates`, of `stretches` of blocks and `bursts`; `overhead` takes its seconds from
  another vehicle's log.
- `unnamed`, what no effect explains: `nameless`, of a `regression` on `columns` of the flight's own signals (`basis`)
  and free `powers`.
- `features`, what a flight's signals do to one another, in numbers: of its `flight_signals` the `coherence`, `moments`
  and `edge_steps`, each number a `feature`, all of them `flight_features`; their `feature_space`.
- `relations`, those numbers compared with simulated flights of each effect: each effect an `effect_class`; how likely a
  flight is under it, `density`, under several or something without a name, `hypotheses`; a `library` holds what `build`
  learned by `learning` flights and `exposure` to what has no name, and what `calibration` measured with others; classes
  of a user's effects come from `own_effect`; `readout` gives a strength in the effect's own units; `inference` names
  the effects.
- `naming`, which effect: `looks` are first looks by a `screen`, `judging` fits on one half and judges on the other,
  `rounds` do both for every candidate; `forward` adds effects one by one, each by its `thresholds`, with the `shares`
  that they add; `passing_effect` is tried first; `select` puts these together, unless the relations of signals name the
  effects: `related`; `selection` has the result; `contradiction` by the flights;
  `recorded`: when recorded flights may name an effect.
- `nominal`, what the baseline flights say: their `consistency`; `build_study` measures floor, loop and response,
  `calibrate` fits the vehicle; `apparent` strengths of effects where there are none.
- `where` the gap lies: `band_sums` of a `filter_bank`, in `regimes` of a flight; of these `cell_tables`, a `gap_map`
  and its `summary`, a cell in words: `cell_words`; beside it `rotor_speeds` and `command_power`; without a diagnosis:
  `measure`.
- `answer`: the verdict and the `ranking` by `probabilities`, with the `reasons` against the others; the
  `named_effects` with their intervals; how far: `shrink`, against `controls`; what stays open: `unexplained`; what to
  fly next: `advice`; `words`, `pictures`.
- `balance`, flights without a gyro: the `hover_pattern` of a flight, `hover_hypotheses` drawn from `priors`, their
  evidence by `hover_balance`, what it says: `hover_posterior`; `balance_result`.
- `sealed`, withheld effects: a set is made by `blind`, with effects as strong as `blind_severity` says, its `blind_key`
  opened once; scored by `blind_score` with its `intervals`; all of it: `blind_run`; on a cluster: `on_cluster`.
- `diagnose` calls them all and fills a `result`; what is worked out once stands in a `workspace`, and what
  two cores may do at once goes through `second_process`.
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
