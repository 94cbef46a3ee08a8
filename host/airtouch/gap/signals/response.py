"""The torque view: measured angular acceleration y held against w, what the model makes of the logged commands.

Both are spectra (blocks, bins, 3) about three axes, rad/s^2/sqrt(Hz). Nominal flights give a law E[y | w] for each of
two kinds of blocks, quiet ones and those in which a set-point stepped (`Law`). Of a flight under a hypothesis the
torque's gap (blocks, bins, 3) is y minus that, plus what effects add to it, weighted to the floor of quiet blocks. In
the spectra of the gap it takes the place of measured minus modelled torque (`Response.with_torque_gap`).

A log at 100 Hz holds one command in five of a 500 Hz loop: fast noise folds into its band and never turned the vehicle,
and the kicks of the outer loop's steps, which did, are mostly not in it. So of w only a part is to be expected in y, by
frequency and axis: q is the H1 estimate, lowered by the noise in w and deliberately not corrected for it (regression
dilution: Fuller, Measurement Error Models, 1987, chapter 1).

    E[y | w] = q w,  q = S_yw / S_ww                             from flights declared nominal: `Law.transfer`
    q~ = q clip((coherence - noise) / noise, 0, 1)               0 where gyro noise in both makes q: `Law.coherent`
    gap = y - q~ c w + what effects add                          c: ratio of q with effects to q without, `Law.ratio`,
                                                                 derived in `loop.torque_share`

The controllers answer the gyro's noise too, so that y and w share it. Where it makes a fraction rho of the power of y,
the coherence that it makes is rho at most. So q is believed from `noise` on: the largest of rho, NOISE and one over
the number of blocks. In yaw, where a small torque takes large commands, y above 2 Hz may be hardly
more than this noise: then q is not believed.

Taken as q = 1, every hypothesis that weakens the response (more inertia, slower motors) would fit. What effects add
comes through the commands, of which a part q~ is seen too, or as a torque from outside, which acts past the loop that
fights it (`loop.disturbed`). Blocks in which a set-point stepped follow another law (the kick is coherent, the aliases
are not) and leave another floor; their gap is weighted to that of quiet ones.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d

from airtouch.gap.flights.blocks import smooth_power
from airtouch.gap.loop.command_spectra import VANISHING_POWER
from airtouch.gap.loop.disturbed import Disturbed
from airtouch.gap.loop.torque_share import QUIET, STEPPED, Change, response_ratio
from airtouch.gap.signals import quiet_blocks
from airtouch.gap.signals.channels import TORQUE
from airtouch.gap.signals.quiet_blocks import QuietPower
from airtouch.gap.signals.spectra import SMOOTH, squared

FIRST_BIN = 2  #: bins below it hold the means, which the Hann window spreads over two bins: there q is 1
#: blocks that a response needs, and stepped ones that a law of these needs; chosen
FEWEST_OF_KIND = 8
FEWEST_QUIET = 2  #: quiet blocks that each axis needs: the coherence of a single one is 1, whatever is in it
#: relative error of the loop model in that change of the transfer function which the command's limits make: that in
#: simulated flights with attitude gains of 0.5, 1.4 and 2, ten flights each
CUT_DOUBT = 0.3
#: least coherence from which q is believed, and from twice this in full; below it the gyro's noise in both y and w may
#: make q; chosen, not measured. With a larger one more bins lose their q~, and the torque there says
#: less of effects that act through the commands; with a smaller one noise that the vehicle's file does not declare
#: counts as a response
NOISE = 0.2


@dataclass(frozen=True)
class TorqueSpectra:
    """Spectra (blocks, bins, 3) of the angular acceleration about the three axes, rad/s^2/sqrt(Hz).

    measured: of the gyro's differences. modelled: what the model without effects makes of the logged commands.
    by_command, disturbance: what effects add to measured minus modelled through the commands, the loop as it was, and
    as torques that no command makes; None for nothing.
    """

    measured: np.ndarray
    modelled: np.ndarray
    by_command: np.ndarray | None = None
    disturbance: np.ndarray | None = None

    def of_blocks(self, index: np.ndarray) -> "TorqueSpectra":
        """The same of some blocks."""
        return TorqueSpectra(self.measured[index], self.modelled[index],
                             None if self.by_command is None else self.by_command[index],
                             None if self.disturbance is None else self.disturbance[index])


class OutsideTorque(NamedTuple):
    """What the torque's gap, before a law's weight, has of a torque from outside; (bins, 3) each, without unit.

    transfer: complex, gap over a known torque; power: power of the gap over that of a random torque.
    """

    transfer: np.ndarray
    power: np.ndarray


@dataclass(frozen=True)
class Law:
    """How the measured torque follows the modelled one in blocks of one kind; (bins, 3) each, but the kind.

    kind: of the blocks that it was measured in and holds for, QUIET or STEPPED. transfer: q, coherent: q~ (both in the
    module's equations), complex, without unit; outside: what the gap has of a torque from outside; weight: rms
    floor of quiet blocks over that of these, 1 for quiet ones; power: S_ww, (rad/s^2)^2/Hz; of_gyro: rho, the fraction
    of the power of y that is the gyro's noise.
    """

    kind: int
    transfer: np.ndarray
    coherent: np.ndarray
    outside: OutsideTorque
    weight: np.ndarray
    power: np.ndarray
    of_gyro: np.ndarray

    @property
    def bounded(self) -> np.ndarray:
        """`coherent`, of a size of 1 at most (bins, 3): the part that is seen of what effects add by the commands."""
        return self.coherent / np.maximum(np.abs(self.coherent), 1.0)

    def ratio(self, change: Change) -> np.ndarray:
        """Ratio c (bins, 3) of q with effects that change the loop to q without: `torque_share.response_ratio`.

        In yaw c becomes 1 + (c - 1) / max(|q~|, 1)^2: where |q~| exceeds 1 it is mostly noise of the gyro, which
        effects do not change.
        """
        out = response_ratio(change, self.kind, self.transfer)
        out[:, 2] = 1.0 + (out[:, 2] - 1.0) / np.maximum(np.abs(self.coherent[:, 2]), 1.0) ** 2
        return out

    def torque_gap(self, torque: TorqueSpectra, change: Change | None) -> np.ndarray:
        """Weighted gap (blocks, bins, 3) of blocks of this law's kind. change: see `Response.with_torque_gap`."""
        c = 1.0 if change is None else self.ratio(change)
        gap = torque.measured - self.coherent * c * torque.modelled
        if torque.by_command is not None:
            gap = gap + self.bounded * torque.by_command
        if torque.disturbance is not None:
            gap = gap + self.outside.transfer * torque.disturbance
        return self.weight * gap

    def random_power(self, sensed: bool) -> np.ndarray:
        """Power (bins, 3) that the torque's gap has of a random torque of unit power. sensed: on the gyro alone."""
        return self.weight ** 2 * (1.0 if sensed else self.outside.power)


@dataclass(frozen=True)
class Response:
    """How the gyro follows the logged commands of nominal flights.

    quiet_power: of the modelled torque in their quiet blocks, smooth over frequency, by which blocks are told quiet or
    stepped. quiet_law, stepped_law: of blocks of either kind, the latter None where nominal flights have too few.
    """

    quiet_power: QuietPower
    quiet_law: Law
    stepped_law: Law | None

    def quiet(self, modelled: np.ndarray) -> np.ndarray:
        """Whether no set-point stepped, bool (blocks, 3), from the modelled torque (blocks, bins, 3)."""
        return quiet_blocks.are_quiet(modelled, self.quiet_power)

    def with_torque_gap(self, spectra: np.ndarray, quiet: np.ndarray, torque: TorqueSpectra,
                        change: Change | None = None) -> np.ndarray:
        """Spectra (blocks, bins, COUNT) of the gap in which the torque's gap is that to the laws.

        It does so above the bins of the means (FIRST_BIN), and is NaN in a block for which there is no law.

        spectra (blocks, bins, COUNT): of measured minus modelled, with all effects in the model. quiet (blocks, 3):
        whether no set-point stepped on an axis. torque: of the same blocks. change: what effects that change the loop
        make of the torque of a command; None for no such effect.
        """
        gap = self.quiet_law.torque_gap(torque, change)
        with_step = np.flatnonzero(~quiet.all(axis=1))  # on some axis
        if len(with_step):
            stepped = np.full(gap[with_step].shape, np.nan) if self.stepped_law is None else \
                self.stepped_law.torque_gap(torque.of_blocks(with_step), change)
            gap[with_step] = np.where(quiet[with_step, None], gap[with_step], stepped)
        out = spectra.copy()
        out[:, FIRST_BIN:, TORQUE] = gap[:, FIRST_BIN:]
        return out

    @property
    def may_be_gyro(self) -> np.ndarray:
        """Whether the gyro's noise may make what y and w share, bool (bins, 3); not in the bins of the means."""
        out = self.quiet_law.of_gyro > NOISE
        out[:FIRST_BIN] = False
        return out

    def weighted(self, quiet: np.ndarray, torque: np.ndarray) -> np.ndarray:
        """Torque (blocks, bins, 3) weighted as its gap is in quiet and in other blocks (blocks, 3)."""
        stepped = np.nan if self.stepped_law is None else self.stepped_law.weight
        return torque * np.where(quiet[:, None], self.quiet_law.weight, stepped)

    def doubt(self, quiet: np.ndarray, modelled: np.ndarray, change: Change) -> np.ndarray:
        """Power (blocks, bins, 3) that the torque's gap may have as steps, and what the limits cut of them, differ.

        quiet (blocks, 3): whether no set-point stepped; modelled: torque of the commands (blocks, bins, 3).
        """
        law = self.stepped_law
        if law is None:
            return np.zeros(modelled.shape)
        doubt = (CUT_DOUBT * law.weight * np.abs(law.coherent) * change.cut) ** 2
        return np.where(quiet[:, None], 0.0, np.nan_to_num(doubt) * squared(modelled))

    def random_power(self, quiet: np.ndarray, sensed: bool) -> np.ndarray:
        """Power (blocks, bins, 3) that the torque's gap has of a random torque of unit power; 1 in the means.

        sensed: on the gyro alone.
        """
        in_quiet = self.quiet_law.random_power(sensed)
        in_stepped = np.ones(in_quiet.shape) if self.stepped_law is None else self.stepped_law.random_power(sensed)
        out = np.nan_to_num(np.where(quiet[:, None], in_quiet, in_stepped), nan=1.0)  # without a law none is counted
        out[:, :FIRST_BIN] = 1.0
        return out


def response_of(torques: Sequence[TorqueSpectra], loop: Disturbed, gyro_power: np.ndarray) -> Response | None:
    """The response of nominal flights from the torque of each; None for too few blocks, or too few quiet.

    The latter are few on an axis where flights differ in strength so much that none is like the others.

    loop: what it makes of a torque from outside; gyro_power (bins, 3): of the gyro's noise in measured torque,
    (rad/s^2)^2/Hz.
    """
    modelled = [t.modelled for t in torques]
    y, w = np.concatenate([t.measured for t in torques]), np.concatenate(modelled)
    if len(y) < FEWEST_OF_KIND:
        return None
    power, quiet = quiet_blocks.estimate_quiet_power(modelled, np.abs(w) ** 2)
    if quiet.sum(axis=0).min() < FEWEST_QUIET:
        return None
    quiet_law, floor = _law(QUIET, y, w, quiet, loop, gyro_power, None)
    stepped_law = None
    if (~quiet).any(axis=1).sum() >= FEWEST_OF_KIND:
        stepped_law, _ = _law(STEPPED, y, w, ~quiet, loop, gyro_power, floor)
    return Response(QuietPower(_smooth(power.mean), power.calm), quiet_law, stepped_law)


def _law(kind: int, y: np.ndarray, w: np.ndarray, chosen: np.ndarray, loop: Disturbed, gyro_power: np.ndarray,
         floor: np.ndarray | None) -> tuple[Law, np.ndarray]:
    """Law of the blocks of a kind, which are chosen for each axis, bool (blocks, 3), and their floor (bins, 3).

    y, w: measured and modelled torque of all blocks. gyro_power: see `response_of`. floor: to which the
    law weights them; None for their own.
    """
    mask, count = chosen[:, None], np.maximum(chosen.sum(axis=0), 1)

    def mean(values: np.ndarray) -> np.ndarray:
        """Mean (bins, 3) over the chosen blocks."""
        return (values * mask).sum(axis=0) / count

    power, measured_power = mean(np.abs(w) ** 2), np.maximum(mean(np.abs(y) ** 2), VANISHING_POWER)
    q = mean(y * w.conj()) / np.maximum(power, VANISHING_POWER)
    coherence = _smooth(np.abs(q) ** 2 * power / measured_power)
    transfer = _smooth(q.real) + 1j * _smooth(q.imag)
    of_gyro = _smooth(gyro_power / measured_power)
    noise = np.maximum(of_gyro, np.maximum(NOISE, 1.0 / count))  # of n blocks of noise the coherence is 1/n by chance
    coherent = transfer * np.clip((coherence - noise) / noise, 0.0, 1.0)
    residual_power = np.maximum(mean(np.abs(y - coherent * w) ** 2), VANISHING_POWER)
    own_floor = smooth_power(residual_power, count, SMOOTH)
    enough = chosen.sum(axis=0) >= FEWEST_OF_KIND
    weight = np.ones(own_floor.shape) if floor is None else np.where(enough, np.sqrt(floor / own_floor), np.nan)
    answer = coherent * loop.commanded  # what the loop commands against a torque from outside, as far as it is seen
    outside = OutsideTorque(loop.measured - answer, loop.power_beyond(coherent))
    return Law(kind, transfer, coherent, outside, weight, _smooth(power), of_gyro), own_floor


def _smooth(values: np.ndarray) -> np.ndarray:
    """Values (bins, 3) averaged over neighbouring bins."""
    return gaussian_filter1d(values, SMOOTH, axis=0, mode="nearest")
