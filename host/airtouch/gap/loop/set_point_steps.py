"""Steps of a velocity's set-point: how strong they are in a block, and what loop and limits make of them."""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from airtouch.gap.loop.axis_plant import AxisPlant
from airtouch.gap.loop.controller import Controller
from airtouch.gap.loop.loop_model import LoopParts, factors_of
from airtouch.gap.loop.noise_spectra import WANDER_HZ, kick_of, set_point_paths

UNCUT = 0.95  #: share of a kick from which the command's limits do not cut it: one step of `command_response.KICKS`
#: Power of the gains with which the uncut share of a kick falls, from ten pairs of simulated flights each with attitude
#: gains of 0.5 to 1.5 and rate gains of 0.8 to 1.3.
CUT_POWER = 0.6


class Step(NamedTuple):
    """Steps of a velocity set-point in a block.

    power: of the steps, over that of noise of unit strength; kick: share of the derivative at the first sample that is
    left by the limits of the command, which are 16 bits and what the motors take.
    """

    power: float = 0.0
    kick: float = 1.0


NO_STEP = Step()


def step_transfers(c: Controller, plant: AxisPlant, f: np.ndarray, parts: LoopParts, kicks: Iterable[float],
                   ) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Transfers (bins,) of roll or pitch from steps of the velocity's set-point to logged command and acceleration.

    parts: of the loop at f. kicks: shares of the first sample's derivative that the command's limits leave, a pair
    for each; what follows is too small for them. With d the path of the set-point to the command and p the share of
    its controller that the limits pass: w = P p d / (1 + P K), u_log = k d - K_log w.
    """
    factors = factors_of(c, f)
    direct = set_point_paths(c, plant, factors)[1] / np.maximum(f, WANDER_HZ)  # a step falls with the frequency
    per_command = parts.plant / parts.return_difference
    logged_controller = parts.logged_controller(kick_of(c, factors))
    for kick in kicks:
        passed = (factors.integral + kick * (factors.pid - factors.integral)) / factors.pid if c.on_error else 1.0
        rate = per_command * passed * direct
        yield kick_of(c, factors, kick) * direct - logged_controller * rate, factors.s * rate


def step_under(step: Step, c: Controller, before: AxisPlant, after: AxisPlant) -> Step:
    """Steps of the same set-point in the plant `after`; step: those in `before`.

    What the limits leave of the first sample of a large step has one size however high the gains; smaller steps are
    not cut: together it falls by CUT_POWER of the gains.
    """
    if step.kick >= UNCUT or not c.on_error:
        return step
    ahead = c.derivative / c.period_s
    gains = [p.rate_gain * p.attitude_gain * p.position_gain for p in (before, after)]
    kick = ((1.0 + ahead * step.kick) * (gains[0] / gains[1]) ** CUT_POWER - 1.0) / ahead
    return step._replace(kick=float(np.clip(kick, 0.0, 1.0)))
