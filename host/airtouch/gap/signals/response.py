"""How the measured angular acceleration follows the logged commands in nominal flights.

A log at 100 Hz holds one command in five of a 500 Hz loop: fast noise folds into its band and never turned the
vehicle, and the kicks of the outer loop's steps, which did, are mostly not in it. Of the torque
that a model makes of logged commands only a share, by frequency and axis, is then to be
expected in the gyro: E[y | w] = q w (Wiener; errors in variables). Taken as q = 1, every
hypothesis that weakens the response (more inertia, slower motors) would fit.
Flights declared nominal give q = S_yw / S_ww; a hypothesis that changes the response or
the loop scales it as the loop model says, an outside torque acts past the loop that fights it.
Blocks in which a set-point stepped follow another law (the kick is coherent, the aliases
are not) and leave another floor.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d

from airtouch.gap.loop.closed_loop import Change
from airtouch.gap.loop.disturbed import Disturbed
from airtouch.gap.signals.channels import TORQUE
from airtouch.gap.signals.spectra import squared

FIRST_BIN = 2  #: below it lie the means, which the window spreads over two bins: there q is 1
QUIET_BINS = slice(2, 31)  #: 0.8 to 12 Hz, in which a step of the set-point shows
STEPPED = 2.0  #: times the usual power of the commanded torque, from which a set-point stepped
CALM = 0.25  #: share of a flight's blocks that no step is in
ROUNDS = 4  #: in which quiet blocks are found; the last two agree
FEWEST = 8  #: blocks of nominal flights
SMOOTH = 1.5  #: bins
#: what the model may be wrong by, of that change of the share which the command's limits make: so far off are pairs of
CUT_DOUBT = 0.3  #: simulated flights with attitude gains of 0.5, 1.4 and 2 (ten flights each)
#: of the commands that answer a torque, by which the loop model is wrong: so far off are eight pairs of simulated
ANSWER_DOUBT = 0.2  #: flights with thrust noise and without, where turning and answer all but cancel (yaw, 1 to 4 Hz)
SHARE_DOUBT = 0.2  #: by which `seen` differs from the loop model in simulated flights of its own loop
NOISE = 0.2  #: coherence up to which it is the noise of the gyro that both have, not believed


@dataclass(frozen=True)
class Law:
    """For torque channels, complex (bins, 3): seen, measured over modelled; told, the same as far as it is no noise of

    the gyro; changed, that for what a hypothesis changes of the model, never above 1 in size; outside, what is left of
    a torque that no command makes. shaken (bins, 3): power that is left of a random one; weight (bins, 3): floor of
    quiet blocks over that of these, rms; power (bins, 3): of the modelled torque.
    """

    seen: np.ndarray
    told: np.ndarray
    changed: np.ndarray
    outside: np.ndarray
    shaken: np.ndarray
    weight: np.ndarray
    power: np.ndarray

    def ratio(self, change: Change, which: int) -> np.ndarray:
        """By what effects that change the loop multiply `told`, (bins, 3).

        Of the commands a share follows the loop model, the rest turn the vehicle as they say; the share is the one that
        makes `seen` of both, or all where the two hardly differ. In yaw, mostly noise of the gyro, motors count where
        it is none.
        """
        before, after = change.before[which], change.motors * change.share[which] * change.before[which]
        away = before - 1.0
        follows = ((self.seen * change.logged - 1.0) * away.conj()).real
        modelled = np.clip((follows + SHARE_DOUBT ** 2) / (np.abs(away) ** 2 + SHARE_DOUBT ** 2), 0.0, 1.0)
        out = (modelled * after + (1.0 - modelled) * change.motors) / (modelled * before + 1.0 - modelled)
        out[:, 2] = 1.0 + (out[:, 2] - 1.0) / np.maximum(np.abs(self.told[:, 2]), 1.0) ** 2
        return out


@dataclass(frozen=True)
class Response:
    """usual (bins, 3): power of the modelled torque in nominal flights, whose quietest quarter of blocks has no more

    than a share calm (3,) of it; the laws of quiet and of stepped blocks, the latter None where nominal flights have
    too few of them.
    """

    usual: np.ndarray
    calm: np.ndarray
    steady: Law
    stepped: Law | None

    def quiet(self, modelled: np.ndarray) -> np.ndarray:
        """Whether no set-point stepped, bool (blocks, 3), from the modelled torque (blocks, bins, 3)."""
        return _quiet(modelled, self.usual, self.calm)

    def applied(self, quiet: np.ndarray, measured: np.ndarray, nominal: np.ndarray, driven: np.ndarray,
                outside: np.ndarray, every: np.ndarray, change: Change | None = None) -> np.ndarray:
        """Spectra (blocks, bins, COUNT) of the gap from those of measured minus modelled; NaN where no law is known.

        quiet (blocks, 3): see there; measured: of the angular acceleration (blocks, bins, 3);
        nominal: left by the model without effects, driven: with those that act through the
        commands yet leave the loop as it is, outside: with those and outside torques, every: with all;
        change: by effects that change the loop.
        """
        first = nominal[:, :, TORQUE]
        through = None if driven is nominal else driven[:, :, TORQUE] - first
        beside = None if outside is driven else outside[:, :, TORQUE] - driven[:, :, TORQUE]
        rest = _rest(self.steady, change, 0, measured, first, through, beside)
        odd = np.flatnonzero(~quiet.all(axis=1))  # blocks in which a set-point stepped on some axis
        if len(odd):
            other = np.array(np.nan) if self.stepped is None else _rest(
                self.stepped, change, 1, measured[odd], first[odd], None if through is None else through[odd],
                None if beside is None else beside[odd])
            rest[odd] = np.where(quiet[odd, None], rest[odd], other)
        out = every.copy()
        out[:, FIRST_BIN:, TORQUE] = rest[:, FIRST_BIN:]
        return out

    def weighted(self, quiet: np.ndarray, torque: np.ndarray) -> np.ndarray:
        """Torque (blocks, bins, 3) weighted as what is left of it is in quiet and in other blocks (blocks, 3)."""
        other = np.nan if self.stepped is None else self.stepped.weight
        return torque * np.where(quiet[:, None], self.steady.weight, other)

    def doubt(self, quiet: np.ndarray, modelled: np.ndarray, change: Change) -> np.ndarray:
        """Power (blocks, bins, 3) that the gap may have as steps differ in size, and so in what the command's limits

        leave of them. quiet (blocks, 3): see there; modelled: torque of the commands (blocks, bins, 3).
        """
        law = self.stepped
        if law is None:
            return np.zeros(modelled.shape)
        doubt = (CUT_DOUBT * law.weight * np.abs(law.told) * change.cut) ** 2
        return np.where(quiet[:, None], 0.0, np.nan_to_num(doubt) * squared(modelled))

    def added(self, quiet: np.ndarray, sensed: bool) -> np.ndarray:
        """Power (blocks, bins, 3) that is left of a random torque of unit power; 1 in the means.

        sensed: on the gyro alone.
        """
        made = [np.ones(self.usual.shape) if law is None else
                law.weight ** 2 * (1.0 if sensed else law.shaken) for law in (self.steady, self.stepped)]
        out = np.nan_to_num(np.where(quiet[:, None], *made), nan=1.0)  # no law: such blocks do not count
        out[:, :FIRST_BIN] = 1.0
        return out


def _rest(law: Law, change: Change | None, which: int, measured: np.ndarray, first: np.ndarray,
          through: np.ndarray | None, beside: np.ndarray | None) -> np.ndarray:
    """Weighted torque (blocks, bins, 3) that a law leaves of blocks of its kind (`which`, of `Law.ratio`).

    through, beside: what effects change of the model through the commands and past them; None for nothing.
    """
    rest = measured - law.told * (1.0 if change is None else law.ratio(change, which)) * (measured - first)
    for share, moved in ((law.changed, through), (law.outside, beside)):
        if moved is not None:
            rest = rest + share * moved
    return law.weight * rest


def response_of(measured: Sequence[np.ndarray], left: Sequence[np.ndarray], loop: Disturbed) -> Response | None:
    """From spectra (blocks, bins, 3) of nominal flights: measured, and measured minus modelled.

    loop: what it makes of a torque from outside. None for too few blocks.
    """
    y = np.concatenate(measured)
    w = y - np.concatenate(left)
    if len(y) < FEWEST:
        return None
    made, power = [m - rest for m, rest in zip(measured, left, strict=True)], np.abs(w) ** 2
    quiet = np.ones((len(w), 3), bool)
    for _ in range(ROUNDS):  # what is usual is so in blocks without a step
        usual = np.nanmedian(np.where(quiet[:, None], power, np.nan), axis=0) / np.log(2.0)
        calm = np.median([np.quantile(_sizes(m, usual), CALM, axis=0) for m in made if len(m)], axis=0)
        quiet = np.concatenate([_quiet(m, usual, calm) for m in made])
    steady, floor = _law(y, w, quiet, loop, None)
    stepped = None
    if (~quiet).any(axis=1).sum() >= FEWEST:
        stepped, _ = _law(y, w, ~quiet, loop, floor)
    return Response(_smooth(usual), calm, steady, stepped)


def _law(y: np.ndarray, w: np.ndarray, chosen: np.ndarray, loop: Disturbed, floor: np.ndarray | None,
         ) -> tuple[Law, np.ndarray]:
    """Law of the chosen blocks (blocks, 3), weighted to have a floor (bins, 3), their own by default; their floor."""
    mask, count = chosen[:, None], np.maximum(chosen.sum(axis=0), 1)
    power = (np.abs(w) ** 2 * mask).sum(axis=0) / count
    share = (y * w.conj() * mask).sum(axis=0) / count / np.maximum(power, 1e-30)
    follows = _smooth(np.abs(share) ** 2 * power / np.maximum((np.abs(y) ** 2 * mask).sum(axis=0) / count, 1e-30))
    seen = _smooth(share.real) + 1j * _smooth(share.imag)
    told = seen * np.clip((follows - NOISE) / NOISE, 0.0, 1.0)
    rest = np.exp(_smooth(np.log(np.maximum((np.abs(y - told * w) ** 2 * mask).sum(axis=0) / count, 1e-30))))
    known = chosen.sum(axis=0) >= FEWEST
    weight = np.ones(rest.shape) if floor is None else np.where(known, np.sqrt(floor / rest), np.nan)
    answered = told * loop.commanded
    outside = loop.turned - answered
    shaken = np.abs(outside) ** 2 + np.abs(ANSWER_DOUBT * answered) ** 2
    return Law(seen, told, told / np.maximum(np.abs(told), 1.0), outside, shaken, weight, _smooth(power)), rest


def _quiet(modelled: np.ndarray, usual: np.ndarray, calm: np.ndarray) -> np.ndarray:
    """Blocks without a step, bool (blocks, 3): their modelled torque (blocks, bins, 3) is as strong as in the quietest

    quarter of this flight's, which in nominal flights has a share calm (3,) of what is usual. A gain that is lower
    makes both the noise and the steps weaker, so that a limit fixed by nominal flights would take steps for noise.
    """
    size = _sizes(modelled, usual)
    return size < STEPPED * np.quantile(size, CALM, axis=0) / calm if len(size) else np.zeros((0, 3), bool)


def _sizes(modelled: np.ndarray, usual: np.ndarray) -> np.ndarray:
    """Power (blocks, 3) of the modelled torque (blocks, bins, 3) over the usual one, where a step shows."""
    return (np.abs(modelled) ** 2 / np.maximum(usual, 1e-30))[:, QUIET_BINS].mean(axis=1)


def _smooth(values: np.ndarray) -> np.ndarray:
    return gaussian_filter1d(values, SMOOTH, axis=0, mode="nearest")
