"""What a torque from outside, or noise of the gyro, leaves in a log: in the measured turn, and in the commands.

The loop answers within milliseconds, and its answer is in the log as well: held over a sample of the log, with or
without the kicks of steps, which are over in one run of the controller. A model that replays the log takes that for
what turned the vehicle.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from airtouch.gap.flights.flight import PERIOD_S
from airtouch.gap.loop.axis_plant import AxisPlant, PlantRow, arm_of, axis_plant
from airtouch.gap.loop.controller import AXES, DEGREES, Controller, newtons_per_command, share_of_gain
from airtouch.gap.loop.loop_model import LOWEST_HZ, factors_of, loop_parts, plant_of, sensed_late, torque_per_command
from airtouch.gap.loop.noise_spectra import FOLDS, difference, kick_of
from airtouch.simulation.firmware import settings

#: relative error of the loop model in the commands that answer a torque: that in eight pairs of simulated flights with
#: and without thrust noise, where turning and answer all but cancel (yaw, 1 to 4 Hz)
ANSWER_DOUBT = 0.2


class Disturbed(NamedTuple):
    """Roll, pitch and yaw, complex (bins, 3) each, for an outside angular acceleration of 1.

    measured: by the gyro; commanded: what a model makes of the logged commands.
    """

    measured: np.ndarray
    commanded: np.ndarray

    def power_beyond(self, share: np.ndarray | float = 1.0) -> np.ndarray:
        """Power (bins, 3) that measured minus a share of the commanded has of an outside acceleration of unit power.

        share (bins, 3), complex: all of it where a model replays the commands.
        """
        answer = share * self.commanded
        return np.abs(self.measured - answer) ** 2 + np.abs(ANSWER_DOUBT * answer) ** 2


class AxisTransfers(NamedTuple):
    """Transfer functions of an axis, complex (bins,): P, K and K_log (`gap.loop`)."""

    plant: np.ndarray
    controller: np.ndarray
    logged: np.ndarray


def disturbed(controllers: Sequence[Controller], row: PlantRow, f: np.ndarray) -> Disturbed:
    """At frequencies f (bins,), Hz. controllers: of AXES.

    The vehicle turns by S of an outside acceleration, S = 1 / (1 + P K), and the log has the command -K_log S / s of
    it. The yaw loop is the firmware's, at the pace of the roll loop. Raises AirTouchError where its rate has no
    proportional gain.
    """
    f = np.maximum(f, LOWEST_HZ)
    _, roll, pitch = controllers
    axes = [_responses(roll, f, _tilt(roll, axis_plant(row, AXES[1]), f)),
            _responses(pitch, f, _tilt(pitch, axis_plant(row, AXES[2]), f)),
            _responses(roll, f, _yaw(roll, row, f))]
    return Disturbed(*(np.stack(x, axis=1) for x in zip(*axes, strict=True)))


def gyro_noise_replayed(controllers: Sequence[Controller], row: PlantRow, f: np.ndarray) -> np.ndarray:
    """Power (bins, 3) that measured minus replayed has of the gyro's noise, over that of the noise's differences.

    Noise up to half the rate of the controller folds into the log, one frequency of it at each of FOLDS: in the gyro
    as it is, in the command as the controller makes it of that frequency. Of yaw it is 1, as its loop is slow.
    f (bins,): above 0, Hz. controllers: of AXES.
    """
    out = np.ones((len(f), 3))
    for i, c in enumerate(controllers[1:]):
        plant = axis_plant(row, AXES[1 + i])
        modelled = torque_per_command(c, plant, f) * logged_over_flown(c, f)
        total, noise = np.zeros(len(f)), np.zeros(len(f))
        for fold in FOLDS if c.period_s < 0.5 * PERIOD_S else FOLDS[:1]:
            g = f + fold / PERIOD_S
            parts, factors = loop_parts(c, plant, g), factors_of(c, g)
            kick, sensed = kick_of(c, factors), 1.0 / factors.chip
            rate = -parts.plant * (parts.rate + parts.angle) / parts.return_difference
            logged = -(parts.rate + kick * parts.angle) - parts.logged_controller(kick) * rate
            total += np.abs(difference(f) * (sensed + rate) - modelled * logged) ** 2
            noise += np.abs(difference(f) * sensed) ** 2
        out[:, i] = total / noise
    return out


def _responses(c: Controller, f: np.ndarray, axis: AxisTransfers) -> tuple[np.ndarray, np.ndarray]:
    """The two responses of `Disturbed` of one axis, (bins,) each."""
    sensitivity = 1.0 / (1.0 + axis.plant * axis.controller)
    return sensitivity, -axis.plant * logged_over_flown(c, f) * axis.logged * sensitivity


def logged_over_flown(c: Controller, f: np.ndarray) -> np.ndarray:
    """What a model makes of a logged command over what the vehicle's motors make of the same, complex (bins,).

    The model holds it over a sample of the log, the vehicle over a run of its controller c; and of the torque a mean of
    two samples is compared with a difference of the measured rate.
    """
    f = np.maximum(f, LOWEST_HZ)
    over_hold = np.sinc(f * PERIOD_S) * np.exp(-1j * np.pi * f * PERIOD_S) / factors_of(c, f).hold
    return over_hold * np.cos(np.pi * f * PERIOD_S) / np.sinc(f * PERIOD_S)


def _tilt(c: Controller, plant: AxisPlant, f: np.ndarray) -> AxisTransfers:
    """The transfer functions of roll or pitch."""
    parts = loop_parts(c, plant, f)
    return AxisTransfers(parts.plant, parts.controller, parts.logged_controller(kick_of(c, factors_of(c, f))))


def _yaw(c: Controller, row: PlantRow, f: np.ndarray) -> AxisTransfers:
    """The transfer functions of the firmware's yaw: rate within angle. c: of the roll loop, whose filters it shares.

    The angle's derivative is that of a step, as the estimator renews the angle in steps. A rotor's torque on yaw is its
    drag and what speeds it up.
    """
    factors = factors_of(c, f)
    s, loops, roll = factors.s, row["firmware"]["loops"], axis_plant(row, "roll")
    of_rate, of_angle = loops[settings.RATE_YAW], loops[settings.YAW]
    gain = float(of_rate["p"]) * DEGREES * float(row["rate_scale"]) * float(row["rate_gain"]) * newtons_per_command(row)
    filtered = sensed_late(c, roll, f) / factors.lowpass / factors.chip
    rate = gain * (1.0 + share_of_gain(of_rate["i"], of_rate["p"]) / s) * filtered

    def angle(differences: np.ndarray) -> np.ndarray:
        """The path of the angle whose derivative makes these differences, 1/s."""
        steered = float(of_angle["p"]) + float(of_angle["i"]) / s + float(of_angle["d"]) * differences
        return rate * steered * factors.renewed / s

    speed = np.sqrt(float(row["mass"]) * float(row["gravity"]) / (4.0 * float(row["thrust_per_speed2"])))
    lever = float(row["yaw_torque_over_thrust"]) + s * float(row["rotor_inertia"]) / (
        2.0 * float(row["thrust_per_speed2"]) * speed)
    plant = plant_of(c, roll, f) * lever / arm_of(row, 0) * float(row["inertia"][0]) / float(row["inertia"][2])
    return AxisTransfers(plant, rate + angle((1.0 - np.exp(-s * c.period_s)) / c.period_s),
                      rate + angle(c.kicked * factors.outer))
