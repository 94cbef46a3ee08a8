"""Flights as a diagnosis sees them: short-time spectra of the residual, measured minus modelled.

COUNT: the number of channels of `signals.channels`, in whose units the spectra are. AIR, REST: the states of a block
(`signals.spectra`).
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from airtouch.gap.flights.flight import GROUND, PERIOD_S, Flight
from airtouch.gap.signals.channels import COMMAND, COUNT, TORQUE, ReplayedFlight, angular_acceleration
from airtouch.gap.signals.lost_rows import bridged_residual, bridging_power
from airtouch.gap.signals.response import FIRST_BIN, Response, TorqueSpectra
from airtouch.gap.signals.spectra import AIR, REST, frequencies, short_time_spectra, starts
from airtouch.gap.signatures.signature import signature_of
from airtouch.gap.study import Study
from airtouch.gap.workspace import Workspace
from airtouch.simulation.effects import Active

# Of these three, all chosen, a larger number needs more memory, a smaller one computes more spectra anew.
CACHED_HYPOTHESES = 96  #: hypotheses whose spectra are cached, of flights of CACHED_SAMPLES or less
CACHED_SAMPLES = 20000  #: samples of all flights together, above which fewer hypotheses are cached
LEAST_CACHED_HYPOTHESES = 8  #: hypotheses whose spectra are cached, however long the flights are
Spectra = dict[str, np.ndarray]  #: of one flight by state (AIR, REST), complex (blocks, bins, COUNT), unit/sqrt(Hz)
BlockStarts = dict[str, np.ndarray]  #: first samples of one flight's blocks by state, (blocks,)


@dataclass(frozen=True, eq=False)
class Data:
    """Flights with their blocks and the spectra of their residual without effects, each made at its first use.

    study: what nominal flights show; flights: those that are judged; workspace: what is cached of them. Cached spectra
    are shared: nobody may write to them. Two objects are equal only where they are one, as no two share a cache.
    """

    study: Study
    flights: Sequence[Flight]
    workspace: Workspace = field(default_factory=Workspace, init=False, repr=False)

    @property
    def means_only(self) -> bool:
        """Whether torque counts in its means alone.

        Without a response of nominal flights nobody can tell how much of the faster logged commands is torque, and how
        much is aliases of the 500 Hz loop.
        """
        return self.study.response is None

    @property
    def seconds(self) -> float:
        """How long the flights last together, s."""
        return sum(len(f) for f in self.flights) * PERIOD_S

    @property
    def air_seconds(self) -> float:
        """How long the flights are in the air together, s."""
        return sum(int(np.count_nonzero(f.phase != GROUND)) for f in self.flights) * PERIOD_S

    @cached_property
    def block_starts(self) -> list[BlockStarts]:
        """First sample of each block, by flight and state."""
        return [{state: starts(f, state) for state in (AIR, REST)} for f in self.flights]

    @cached_property
    def measured_torque(self) -> list[np.ndarray]:
        """Spectra (blocks, bins, 3) in the air of the measured angular acceleration, by flight."""
        return [short_time_spectra(angular_acceleration(f), first[AIR], AIR)
                for f, first in zip(self.flights, self.block_starts, strict=True)]

    @cached_property
    def quiet(self) -> list[np.ndarray]:
        """Whether no set-point stepped, by flight, for each block in the air and axis (blocks, 3), bool.

        The list is empty without a response.
        """
        response = self.study.response
        return [] if response is None else [response.quiet(command_torque(self, i)) for i in range(len(self.flights))]

    @cached_property
    def bridging(self) -> list[np.ndarray]:
        """Power (blocks, bins, COUNT) that lost rows add in the air, by flight, unit^2/Hz."""
        study = self.study
        quiet: list[np.ndarray | None] = [*self.quiet] if self.quiet else [None for _ in self.flights]
        return [bridging_power(f, study.vehicle, study.calibration, first[AIR], where, study.response)
                for f, first, where in zip(self.flights, self.block_starts, quiet, strict=True)]

    @cached_property
    def residual(self) -> list[Spectra]:
        """Spectra (blocks, bins, COUNT) of the residual without effects, by flight and state, unit/sqrt(Hz)."""
        return residual_spectra(self, ())


def residual_spectra(data: Data, active: Sequence[Active], flights: Iterable[int] | None = None) -> list[Spectra]:
    """Spectra (blocks, bins, COUNT) of the residual with effects in the model, by flight and state, unit/sqrt(Hz).

    The channels of the commands are 0: the command view judges them. Where nominal flights show how the gyro follows
    the commands (`Study.response`), torque is compared with what that leads to expect, else with the replay's.
    flights: indices in `Data.flights` of those that are worked out, all by default; the others' are empty.
    """
    needed = range(len(data.flights)) if flights is None else set(flights)
    return [_residual_of(data, i, active) if i in needed else {} for i in range(len(data.flights))]


def _residual_of(data: Data, i: int, active: Sequence[Active]) -> Spectra:
    """The entry of flight i in `residual_spectra`."""
    response = data.study.response
    replayed = [a for a in active if not signature_of(a.effect).commands_only]
    if response is None:
        return _without_scaling(data, i, replayed)
    return _cached(data, "by response", i, active, lambda: _by_response(data, i, response, active, replayed))


def _by_response(data: Data, i: int, response: Response, active: Sequence[Active], replayed: Sequence[Active],
                 ) -> Spectra:
    """Spectra of the residual of flight i, torque compared with what the commands lead to expect.

    replayed: the effects that do not show in the commands alone.
    """
    residual = _replay_spectra(data, i, replayed)
    if data.flights[i].rates is None:
        return residual
    loop = data.study.loop
    assert loop is not None  # a response is known of nominal flights, and so is their loop
    not_loop = [a for a in replayed if not loop.changes_loop((a,))]
    by_command = [a for a in not_loop if a.effect.wrench is None]
    torque = _torque_spectra(data, i, by_command, not_loop)
    change = loop.torque_change(active, frequencies(AIR))
    return {**residual, AIR: response.with_torque_gap(residual[AIR], data.quiet[i], torque, change)}


def _torque_spectra(data: Data, i: int, by_command: Sequence[Active], not_loop: Sequence[Active]) -> TorqueSpectra:
    """Torque of flight i in the air, and what effects change of it; None for a change that no effect makes.

    by_command: effects that act through the commands; not_loop: these, and beside them those that push from outside.
    """
    nominal, driven, disturbed = (_replay_spectra(data, i, some)[AIR][:, :, TORQUE]
                                  for some in ((), by_command, not_loop))
    return TorqueSpectra(data.measured_torque[i], data.measured_torque[i] - nominal,
                         driven - nominal if by_command else None,
                         disturbed - driven if len(not_loop) > len(by_command) else None)


def command_torque(data: Data, i: int) -> np.ndarray:
    """Spectra (blocks, bins, 3) in the air of the torque that the model makes of the logged commands of flight i."""
    return data.measured_torque[i] - _replay_spectra(data, i, ())[AIR][:, :, TORQUE]


def step_doubt(data: Data, active: Sequence[Active], flights: Iterable[int]) -> list[Spectra] | None:
    """Power (blocks, bins, COUNT) by flight and state by which the residual is uncertain where a set-point stepped.

    The limits of the commands clip the torque of a step, and effects of the loop change how much they clip. None where
    they do not. Power in unit^2/Hz; flights: as for `residual_spectra`.
    """
    response, loop = data.study.response, data.study.loop
    change = loop.torque_change(active, frequencies(AIR)) if response is not None and loop is not None else None
    if response is None or change is None or not change.cut.any():
        return None
    out: list[Spectra] = [{} for _ in data.flights]
    for i in set(flights):
        out[i] = {state: np.zeros(x.shape) for state, x in data.residual[i].items()}
        if data.flights[i].rates is not None:
            doubt = response.doubt(data.quiet[i], command_torque(data, i), change)
            out[i][AIR][:, FIRST_BIN:, TORQUE] = doubt[:, FIRST_BIN:]
    return out


def _without_scaling(data: Data, i: int, active: Sequence[Active]) -> Spectra:
    """Spectra of the residual of flight i without a response of nominal flights.

    Effects that only scale the torque are left out of it. Here the torque counts in its means alone; they are the trim,
    which such an effect would shrink although it does not cause it.
    """
    with_all = _replay_spectra(data, i, active)
    unscaled = [a for a in active if not signature_of(a.effect).scales_torque]
    if len(unscaled) == len(active):
        return with_all
    out, without = {state: v.copy() for state, v in with_all.items()}, _replay_spectra(data, i, unscaled)
    for state, v in out.items():
        v[:, :, TORQUE] = without[state][:, :, TORQUE]
    return out


def _replay_spectra(data: Data, i: int, active: Sequence[Active]) -> Spectra:
    """Spectra of what was measured in flight i minus what the model makes of the logged commands; cached."""
    return _cached(data, "spectra", i, active, lambda: _replayed(data, i, active))


def _replayed(data: Data, i: int, active: Sequence[Active]) -> Spectra:
    """`_replay_spectra`, made anew."""
    flight = data.workspace.cached("replayed", i, lambda: ReplayedFlight(data.flights[i], data.study.vehicle))
    bridged = bridged_residual(flight, (*data.study.calibration, *active))
    out = {}
    for state, begin in data.block_starts[i].items():  # the command view judges the commands: here they stay 0
        replayed = short_time_spectra(bridged[:, :COMMAND.start], begin, state)
        out[state] = np.zeros((*replayed.shape[:2], COUNT), complex)
        out[state][:, :, :COMMAND.start] = replayed
    return out


def _cached(data: Data, name: str, i: int, active: Sequence[Active], make: Callable[[], Spectra]) -> Spectra:
    """Spectra of flight i under a hypothesis, made once while it is among the last used; of no effect always.

    The key is the flight's index with the names and values of the effects (`Active.key`), never the identity of an
    object. Those of CACHED_HYPOTHESES hypotheses are kept, of fewer where all flights have more than CACHED_SAMPLES.
    """
    if not active:
        return data.workspace.cached(f"{name} of no effect", i, make)
    samples, n = sum(len(f) for f in data.flights), len(data.flights)
    hypotheses = max(CACHED_HYPOTHESES * CACHED_SAMPLES // max(samples, CACHED_SAMPLES), LEAST_CACHED_HYPOTHESES)
    return data.workspace.cached(name, (i, *(a.key for a in active)), make, hypotheses * n)
