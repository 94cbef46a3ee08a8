"""The columns of the regression as spectra: the flight's own signals, and the torque of its commands, band by band.

In simulated flights of this project's firmware, whose loop is modelled, roll and pitch torque is regressed on that of
the logged commands as well, in time with them and a quarter turn later: how else they turn the vehicle.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from airtouch.gap.evidence.cells import CELLS
from airtouch.gap.evidence.data import Data, command_torque
from airtouch.gap.evidence.problem import BlockSet, Problem
from airtouch.gap.flights.blocks import BANDS_HZ
from airtouch.gap.nameless.basis import BASIS, basis
from airtouch.gap.signals.channels import TORQUE
from airtouch.gap.signals.response import FIRST_BIN
from airtouch.gap.signals.spectra import AIR, frequencies, short_time_spectra
from airtouch.gap.signatures.candidates import mean_of, random_of
from airtouch.gap.signatures.term import Term

CHANNELS = 9  #: the first channels, which are regressed: force, torque, rate
ROLL_PITCH = (TORQUE.start, TORQUE.start + 1)  #: torques whose loop is modelled; yaw torque is mostly gyro noise
TURNS = (1.0, 1.0j)  #: factors on the spectrum of the commands: in phase with them, and a quarter turn off
LOOP_HZ = BANDS_HZ[1:]  #: limits of the bands above that of the means, Hz; the response has no law for the means
LOOP_COLUMNS = len(TURNS) * (len(LOOP_HZ) - 1)  #: columns of a torque beside the basis
WIDEST = len(BASIS) + LOOP_COLUMNS  #: most columns of a channel, without offsets
#: variance of the prior of a coefficient, or of a logarithm of a power, without scatter in nominal flights; chosen,
#: next to none. A larger number lets each flight have some of its own
LEAST_VARIANCE = 1e-9
#: columns of the command that turns the vehicle about each axis of the torque
OF_COMMAND = {c: [BASIS.index(n) for n in (a, f"d_{a}")] for c, a in enumerate(("roll", "pitch", "yaw"), TORQUE.start)}


@dataclass(frozen=True)
class NamelessFloor:
    """Scatter of nominal flights in the nameless model, the width of its priors.

    columns (CHANNELS, WIDEST): rms of the coefficients; power (2, CELLS): mean and rms of the natural logarithm of the
    power over the expected one.
    """

    columns: np.ndarray
    power: np.ndarray


def no_floor() -> NamelessFloor:
    """The floor where no nominal flight is known: coefficients and powers without scatter."""
    return NamelessFloor(np.zeros((CHANNELS, WIDEST)), np.zeros((2, CELLS)))


@dataclass(frozen=True)
class Regressors:
    """What the values of one channel of one flight are regressed on.

    channel: its index in `channels.CHANNELS`; indices (elements,): of the values among the problem's; columns
    (elements, free + offsets): of the regression, the last ones of the offsets; offset_stds (offsets,): standard
    deviations of the offsets' priors.
    """

    channel: int
    indices: np.ndarray
    columns: np.ndarray
    offset_stds: np.ndarray

    @property
    def free(self) -> int:
        """How many columns are not of an offset."""
        return self.columns.shape[1] - len(self.offset_stds)

    def precision(self, floor: NamelessFloor) -> np.ndarray:
        """Inverse variances (free + offsets,) of the priors: of coefficients as in nominal flights, and of offsets."""
        nominal = np.maximum(floor.columns[self.channel, :self.free] ** 2, LEAST_VARIANCE)
        return np.concatenate([1.0 / nominal, 1.0 / self.offset_stds ** 2])


def regressors_of(data: Data, blocks: BlockSet, problem: Problem) -> list[Regressors]:
    """The regressors of each channel of each flight that has valid values among some blocks; made once."""
    return problem.flat.workspace.cached("regressors", (), lambda: _regressors(data, blocks, problem))


def _regressors(data: Data, blocks: BlockSet, problem: Problem) -> list[Regressors]:
    """The regressors of `regressors_of`, made anew."""
    out = []
    e, count = problem.elements, problem.flat.replay_count
    channel, flight, valid = (x[:count] for x in (e.channel, e.flight, e.valid))
    for c in range(CHANNELS):
        table, elements = _table(data, blocks, problem, c), np.flatnonzero(channel == c)
        for f in np.unique(flight):
            here = valid[elements] & (flight[elements] == f)
            indices = elements[here]
            offsets = [(x, o.prior_std) for o in problem.offsets if np.any(x := o.at(indices))]
            if len(indices):
                out.append(Regressors(c, indices, np.column_stack([table[here], *(x for x, _ in offsets)]),
                                      np.array([std for _, std in offsets])))
    return out


def _columns(data: Data) -> list[list[dict[str, np.ndarray]]]:
    """Spectra (blocks, bins, columns) of the basis for x, y and z channels, by flight and state; made once."""
    def make() -> list[list[dict[str, np.ndarray]]]:
        """The spectra, by flight and axis."""
        out = []
        for flight, first in zip(data.flights, data.block_starts, strict=True):
            signals = basis(flight, data.study.vehicle)
            out.append([{state: short_time_spectra(signals[:, :, axis], first[state], state) for state in first}
                        for axis in range(3)])
        return out

    return data.workspace.cached("basis", (), make)


def _loop_columns(data: Data) -> list[np.ndarray]:
    """Spectra (blocks, bins, 2, LOOP_COLUMNS) in the air of the torque that the model makes of the commands, by flight.

    Each column has one band alone, weighted as the residual of the torque is; made once.
    """
    def make() -> list[np.ndarray]:
        """The spectra, by flight."""
        f, response = frequencies(AIR), data.study.response
        bands = np.array([(f >= low) & (f < high) for low, high in pairwise(LOOP_HZ)]).T
        bands[:FIRST_BIN] = False
        shape = np.stack([turn * bands for turn in TURNS], axis=-1).reshape(len(f), 1, LOOP_COLUMNS)
        out = []
        for i in range(len(data.flights)):
            torque = command_torque(data, i)
            weighted = torque if response is None else response.weighted(data.quiet[i], torque)
            out.append(np.nan_to_num(weighted)[:, :, :2, None] * shape)
        return out

    return data.workspace.cached("loop", (), make)


def _table(data: Data, blocks: BlockSet, problem: Problem, channel: int) -> np.ndarray:
    """The columns (elements, columns) at the elements of one channel, in their order."""
    spectra, rows = _columns(data), []
    axis = channel % 3
    for i, state, chosen in blocks.pieces:
        columns = spectra[i][axis][state][chosen]
        if channel in ROLL_PITCH:
            at_rest = np.zeros((*columns.shape[:2], LOOP_COLUMNS))
            loop = _loop_columns(data)[i][chosen, :, axis] if state == AIR else at_rest
            columns = np.concatenate([columns, loop], axis=2)
        rows.append(columns[:, problem.flat.layout.keep[state][:, channel]].reshape(-1, columns.shape[2]))
    return np.concatenate(rows) if rows else np.zeros((0, len(BASIS)), complex)


def allowed_columns(data: Data, terms: Sequence[Term], channel: int) -> np.ndarray:
    """Whether a column may be used beside a hypothesis, bool (WIDEST,).

    Not where the residual of a right hypothesis has the column too. The commands answer a random torque, so that its
    residual follows them. And how a changed loop turns the vehicle about its yaw axis upon a command is not modelled.
    """
    out = np.ones(WIDEST, bool)
    out[len(BASIS):] = data.study.same_models
    loop, yaw = data.study.loop, TORQUE.stop - 1
    if random_of(terms):
        out[OF_COMMAND.get(channel, [])] = False
        out[len(BASIS):] = False
    elif channel == yaw and loop is not None and loop.changes_loop([t.active() for t in mean_of(terms)]):
        out[OF_COMMAND[yaw]] = False
    return out
