"""The torque-share decision: what part of the torque of logged commands turns the vehicle, with and without effects.

A log at 100 Hz holds one command in five of a 500 Hz loop, so of the torque that the motors make of logged commands
only a share is in the rotation. The symbols, by frequency and axis, with S, s and P as in `gap.loop`:

    b = (S_yu / S_uu) / (s P)     share in the loop model without effects         `Change.before`
    r                             share with effects over without                 `Change.share`
    m                             torque per command with effects over without    `Change.motors`
    q                             measured: rotation over the torque that a model makes of the log (`signals.response`)
    l                             what a model makes of a logged command, over     `Change.logged`
                                  what the vehicle's motors make of it
    a                             fraction of the commands that follow the loop model, the others turn the vehicle as
                                  they say
    c                             q with effects over q without                   `response_ratio`

For roll and pitch `axis_torque` has b from the loop model, level and where a set-point stepped; `change_of` compares
the shares with and without effects. Yaw has no model: its share is 1.

The rotation per torque is a b + 1 - a without effects and m (a r b + 1 - a) with them, and c is the second over the
first. As b is over what the motors make of a command, and q over what a model makes of it, q l is a measurement of the
first: a is the best fit to it, within 0 and 1, with a prior of mean 1 and standard deviation 1 (`response_ratio`).
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from airtouch.gap.loop.axis_plant import AxisPlant
from airtouch.gap.loop.command_response import acceleration_per_command
from airtouch.gap.loop.disturbed import logged_over_flown
from airtouch.gap.loop.loop_model import AxisLoop, torque_per_command
from airtouch.gap.loop.set_point_steps import NO_STEP, Step, step_under

SMOOTH = 2.0  #: bins, standard deviation of the Gaussian over frequency: a block's Hann window and `response.SMOOTH`
#: largest ratio that effects may make of a share; beyond, the loop model is not trusted; chosen
MOST_CHANGE = 5.0
#: standard deviation of q l around the loop model's, for a prior of standard deviation 1 of the fraction a: the
#: difference in twelve pairs of simulated flights of its own loop (host/docs/looks.md, 2026-11-24 03:20)
SHARE_DOUBT = 0.2
QUIET, STEPPED = 0, 1  #: places in `Change.before` and `.share`: of level blocks, of those in which a set-point stepped


class Change(NamedTuple):
    """How effects change the torque of a command and the rotation that it causes, effects over without.

    motors, complex (bins, 1): ratio of torque to command. share, complex (2, bins, 3): ratio of the share of the
    commanded torque that turns the vehicle, level and stepped; before: that share in the loop model without effects.
    cut (bins, 3): size of that part of the change of stepped blocks which the limits of the command make.
    logged (bins, 1): `disturbed.logged_over_flown`. incoherent (2, bins, 3): power of the torque that is not coherent
    with the commands, without and with effects, (rad/s^2)^2/Hz.
    """

    motors: np.ndarray
    share: np.ndarray
    before: np.ndarray
    cut: np.ndarray
    logged: np.ndarray
    incoherent: np.ndarray


class AxisTorque(NamedTuple):
    """What becomes of the torque of a command about roll or pitch, at some frequencies.

    motors, complex (bins,): torque that the motors make of a command, rad/s^2 per N. shares, complex (3, bins): share
    of it that turns the vehicle: level, stepped, and stepped if the limits of the command cut as much as in nominal
    flights. incoherent (bins,): power of the torque that is not coherent with the command, (rad/s^2)^2/Hz; 1 for a
    controller that is not the firmware's.
    """

    motors: np.ndarray
    shares: np.ndarray
    incoherent: np.ndarray


def axis_torque(loop: AxisLoop, nominal: AxisPlant, strengths: np.ndarray, nominal_step: Step, f: np.ndarray,
                ) -> AxisTorque:
    """The torque of a command at frequencies f (bins,), Hz, in the loop of one axis.

    nominal: plant of the axis without effects, strengths (sources,): of the noise there, nominal_step: of the
    set-points there.
    """
    motors = torque_per_command(loop.firmware, loop.plant, f)
    step = step_under(nominal_step, loop.controller, nominal, loop.plant)
    per_command = acceleration_per_command(loop.controller, loop.plant, strengths, f, SMOOTH,
                                           (NO_STEP, step, nominal_step))
    return AxisTorque(motors, np.stack(per_command.expected) / motors,
                      per_command.incoherent if loop.by_firmware else np.ones(len(f)))


def change_of(loop: AxisLoop, before: Sequence[AxisTorque], after: Sequence[AxisTorque], f: np.ndarray) -> Change:
    """Change from the torques of roll and pitch without effects to those with them, at frequencies f (bins,), Hz.

    loop: of roll without effects. A controller no faster than the log folds nothing: there the motors alone count.
    """
    share_before, share_after = _with_yaw([x.shares for x in before]), _with_yaw([x.shares for x in after])
    share = share_after / share_before if loop.by_firmware else np.ones_like(share_before)
    share /= np.maximum(np.abs(share) / MOST_CHANGE, 1.0)
    _, stepped, stepped_as_nominal = share
    return Change(
        motors=(after[0].motors / before[0].motors)[:, None], share=share[:2], before=share_before[:2],
        cut=np.abs(stepped - stepped_as_nominal), logged=logged_over_flown(loop.firmware, f)[:, None],
        incoherent=np.stack([_with_yaw([x.incoherent for x in torques]) for torques in (before, after)]))


def response_ratio(change: Change, kind: int, measured: np.ndarray) -> np.ndarray:
    """Ratio c (bins, 3) of the response to logged commands with effects to that without, in the module's symbols.

        c = m (a r b + 1 - a) / (a b + 1 - a),    a minimises |q l - (a b + 1 - a)|^2 + SHARE_DOUBT^2 (a - 1)^2

    kind: of blocks, QUIET or STEPPED; measured: q, complex (bins, 3), in nominal flights' blocks of that kind.
    """
    before = change.before[kind]
    after = change.motors * change.share[kind] * before
    off_one = before - 1.0
    along = ((measured * change.logged - 1.0) * off_one.conj()).real
    follows = np.clip((along + SHARE_DOUBT ** 2) / (np.abs(off_one) ** 2 + SHARE_DOUBT ** 2), 0.0, 1.0)
    return (follows * after + (1.0 - follows) * change.motors) / (follows * before + 1.0 - follows)


def _with_yaw(roll_and_pitch: Sequence[np.ndarray]) -> np.ndarray:
    """Values (..., bins, 3) of roll, pitch and yaw from those of roll and pitch, (..., bins) each; 1 in yaw."""
    return np.stack([*roll_and_pitch, np.ones_like(roll_and_pitch[0])], axis=-1)
