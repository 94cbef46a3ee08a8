"""Command view: the closed loop seen in the power spectra of the commands.

Noise that no log holds drives the controller, so commands cannot be
predicted sample by sample; their spectra can. Flights declared nominal give the spectra
of level flight and, through `loop_model`, the controller and its noise; a hypothesis
then multiplies them by the ratio of the modelled spectra with and without it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np

from airtouch.gap.flights.flight import PERIOD_S, Flight
from airtouch.gap.flights.hardness import Slopes, hardness_of
from airtouch.gap.loop.command_spectra import (
    LENGTH,
    block_spectra,
    commands,
    fine_frequencies,
    frequencies,
    through_window,
)
from airtouch.gap.loop.controller import AXES, Controller, firmware, firmware_of
from airtouch.gap.loop.disturbed import logged_over_flown
from airtouch.gap.loop.edge_response import EdgeFloor
from airtouch.gap.loop.loop_model import excess_phase, of_loop, torque_per_command
from airtouch.gap.loop.noise_spectra import noise_power
from airtouch.gap.loop.turning import (
    NO_STEP,
    Step,
    step_of,
    step_under,
    turning_beside_command,
    turnings_per_command,
)
from airtouch.gap.workspace import Workspace
from airtouch.simulation.effects import Active
from airtouch.simulation.flight import prepare
from airtouch.vehicle import Vehicle

UNSTABLE = 30.0  #: nepers of command power added per rad of phase beyond stability: a loop that could not fly
#: fields of the plant that make the roll and pitch loops, not their noise
LOOP_FIELDS = ("sensor_delay", "actuator_delay", "rate_gain", "attitude_gain", "position_gain", "motor_rise",
               "motor_fall", "inertia", "rate_scale", "gyro_lowpass", "gyro_bandwidth", "rotor_x", "rotor_y")
SMOOTH = 2.0  #: bins: a block's window and `response.SMOOTH`
PLANTS = 500  #: hypotheses whose plant is cached
LOOPS = 1000  #: spectra of an axis that are cached, about 10 kB each
MOST_CHANGE = 5.0  #: largest ratio that effects may make of the share of torque; beyond, the model is not trusted
#: effects that change the commands alone: replayed motor commands hold nothing of them
COMMAND_ONLY = frozenset({"sensor_latency", "controller_gain", "range_step", "flow_scale"})


class Change(NamedTuple):
    """How effects change the torque of a command and the rotation that it causes, effects over without.

    motors, complex (bins, 1): ratio of torque to command. share, complex (2, bins, 3): ratio of the share of the
    commanded torque that turns the vehicle, level and stepped; before: that share in the loop model without effects.
    cut (bins, 3): size of that part of the change of stepped blocks which the limits of the command make.
    logged (bins, 1): `disturbed.logged_over_flown`. unexplained (2, bins, 3): power of the torque that the commands do
    not explain, without and with effects, (rad/s^2)^2/Hz.
    """

    motors: np.ndarray
    share: np.ndarray
    before: np.ndarray
    cut: np.ndarray
    logged: np.ndarray
    unexplained: np.ndarray


@dataclass(frozen=True)
class ClosedLoop:
    """The nominal loops: a controller, noise strengths (sources,) and floor (bins,) for each of AXES.

    floor: PSD of the commands, N^2/Hz, of `blocks` blocks as hard as nominal ones; slopes: of its power with how
    hard the vehicle is flown; steps: of roll and pitch, in blocks in which a set-point stepped.
    """

    vehicle: Vehicle
    calibration: tuple[Active, ...]
    controllers: tuple[Controller, ...]
    by_firmware: bool
    strengths: tuple[np.ndarray, ...]
    floor: np.ndarray
    blocks: int
    slopes: Slopes
    edges: EdgeFloor | None = None
    steps: tuple[Step, Step] = (NO_STEP, NO_STEP)
    workspace: Workspace = field(default_factory=Workspace, init=False, compare=False, repr=False)

    def levelled_spectra(self, flight: Flight) -> tuple[np.ndarray, np.ndarray]:
        """First samples and spectra (blocks, bins, AXES) of a flight's commands as if flown as hard as nominal ones."""
        first, spectra = block_spectra(flight, self.vehicle)
        return first, spectra / np.sqrt(self.slopes.level(hardness_of(flight, first, LENGTH)))

    def ratio(self, active: Sequence[Active]) -> np.ndarray:
        """Expected power of the commands over that of nominal flights, (bins, AXES)."""
        row = self._row(active)
        key = row.tobytes()
        return self.workspace.once("ratio", key, lambda: self._power(row) / self.nominal_power(), PLANTS)

    def torque_change(self, active: Sequence[Active], f: np.ndarray) -> Change | None:
        """How effects change what the vehicle does upon a logged command; None where they leave the loop as it is.

        A controller no faster than the log folds nothing: there the motors alone count.
        """
        row, changed = self._plant(active)
        if not changed:
            return None
        return self.workspace.once("change", (row.tobytes(), f.tobytes()), lambda: self._change(row, f), PLANTS)

    def _change(self, row: Any, f: np.ndarray) -> Change:
        """`torque_change` of the effects that make a plant row."""
        plain, roll = self._plain, AXES[1]
        after, before = self._shares(row, f), self._shares(plain, f)
        share = after / before if self.by_firmware else np.ones_like(before)
        motors = self._torque(row, roll, f) / self._torque(plain, roll, f)
        share /= np.maximum(np.abs(share) / MOST_CHANGE, 1.0)
        _, stepped, stepped_as_nominal = share
        return Change(motors=motors[:, None], share=share[:2], before=before[:2],
                      cut=np.abs(stepped - stepped_as_nominal),
                      logged=logged_over_flown(firmware(plain, roll), f)[:, None],
                      unexplained=np.stack([self._unexplained(plain, f), self._unexplained(row, f)]))

    def changes_loop(self, active: Sequence[Active]) -> bool:
        """Whether effects change the roll and pitch loops."""
        return self._plant(active)[1]

    def same_loop(self, one: Sequence[Active], other: Sequence[Active]) -> bool:
        """Whether the roll and pitch loops are the same under two hypotheses."""
        return _same_loop(self._row(one), self._row(other))

    @cached_property
    def _plain(self) -> Any:
        """Plant row of the vehicle as calibrated."""
        return prepare(self.vehicle, self.calibration)[0][0]

    def _row(self, active: Sequence[Active]) -> Any:
        """Plant row with effects; not to be changed."""
        return self._plant(active)[0]

    def _plant(self, active: Sequence[Active]) -> tuple[Any, bool]:
        """Plant row with effects, and whether they change the roll and pitch loops."""
        def make() -> tuple[Any, bool]:
            row = prepare(self.vehicle, (*self.calibration, *active))[0][0]
            return row, not _same_loop(row, self._plain)

        return self.workspace.once("plant", tuple((a.effect.name, *a.values.values()) for a in active), make, PLANTS)

    def _shares(self, row: Any, f: np.ndarray) -> np.ndarray:
        """Share of the commanded torque that turns the vehicle, complex (3, bins, 3); 1 in yaw.

        Level, stepped, and stepped if the limits of the command cut as much as in nominal flights.
        """
        shares = np.ones((3, len(f), 3), complex)
        for i, axis in enumerate(AXES[1:]):
            shares[:, :, i] = self._of_axis("share", row, axis, f, partial(self._share, row, i + 1, f))
        return shares

    def _share(self, row: Any, i: int, f: np.ndarray, controller: Controller) -> np.ndarray:
        """`_shares` of axis i, complex (3, bins)."""
        nominal = self.steps[i - 1]
        step = step_under(nominal, controller, self._plain, row)
        ratios = turnings_per_command(controller, row, AXES[i], self.strengths[i], f, SMOOTH, (NO_STEP, step, nominal))
        return np.stack(ratios) / self._torque(row, AXES[i], f)

    def _unexplained(self, row: Any, f: np.ndarray) -> np.ndarray:
        """Power (bins, 3) of the torque that the commands do not explain, (rad/s^2)^2/Hz; 1 in yaw, without model."""
        power = np.ones((len(f), 3))
        for i, axis in enumerate(AXES[1:] if self.by_firmware else ()):
            power[:, i] = self._of_axis("unexplained", row, axis, f, partial(self._unexplained_of, row, i + 1, f))
        return power

    def _unexplained_of(self, row: Any, i: int, f: np.ndarray, controller: Controller) -> np.ndarray:
        """`_unexplained` of axis i, (bins,)."""
        return turning_beside_command(controller, row, AXES[i], self.strengths[i], f, SMOOTH)

    def with_steps(self, share: np.ndarray, excess: np.ndarray, f: np.ndarray) -> "ClosedLoop":
        """The same loop with `steps`, from blocks of nominal flights in which a set-point stepped.

        share (bins, 3): of the commanded torque, what turned the vehicle, 0 where it is not known; excess (bins, 3):
        power of these torques over that of other blocks.
        """
        row = self._plain
        roll, pitch = [step_of(firmware(row, axis), row, axis, self.strengths[i], f, excess[:, i - 1],
                               share[:, i - 1] * self._torque(row, axis, f))
                       for i, axis in enumerate(AXES) if i] if self.by_firmware else self.steps
        return replace(self, steps=(roll, pitch))

    def _torque(self, row: Any, axis: str, f: np.ndarray) -> np.ndarray:
        """`loop_model.torque_per_command`."""
        return self._of_axis("torque", row, axis, f, lambda controller: torque_per_command(row, axis, f, controller))

    def _of_axis(self, what: str, row: Any, axis: str, f: np.ndarray, make: Callable[[Controller], Any]) -> Any:
        """What a controller makes of an axis at frequencies f; made once for all plant rows with the same loop."""
        by_firmware, *loops = self._loops(row)[AXES.index(axis)]
        # in the torque of a command a controller counts for its period alone
        controller = by_firmware if self.by_firmware or what == "torque" else self.controllers[AXES.index(axis)]
        key = (what, axis, controller, *loops, f.tobytes())
        return self.workspace.once("axis", key, lambda: make(controller), LOOPS)

    def _loops(self, row: Any) -> list[tuple]:
        """The firmware's controller of each of AXES, and what else a plant row gives its loop."""
        return self.workspace.once("loops", row.tobytes(), lambda: list(
            zip(firmware_of(row), (of_loop(row, axis) for axis in AXES), strict=True)), PLANTS)

    def commands_without(self, flight: Flight, active: Sequence[Active]) -> np.ndarray:
        """Commands (n, 4), N per motor, freed of what the effects did to their spectra."""
        logged = commands(flight, self.vehicle)
        ratio = self.ratio(active)
        if np.all(ratio == 1.0):
            return logged
        f = np.fft.rfftfreq(len(logged), PERIOD_S)
        spectrum = np.fft.rfft(logged, axis=0)
        for i in range(len(AXES)):
            spectrum[:, i] /= np.sqrt(np.interp(f, frequencies(), ratio[:, i]))
        return np.fft.irfft(spectrum, len(logged), axis=0)

    def _gyro_noise(self) -> np.ndarray:
        """Rms (3,) of the calibrated gyro's noise, rad/s."""
        return np.maximum(self._plain["gyro_noise"], 1e-9)

    def nominal_power(self) -> np.ndarray:
        """Power of the commands (bins, AXES) that the model makes of the vehicle as calibrated."""
        return self.workspace.once("power", (), lambda: self._power(self._plain))

    def _power(self, row: Any) -> np.ndarray:
        """Modelled power of the commands (bins, AXES) of a plant row, N^2/Hz; far above any where it would not fly."""
        f = fine_frequencies()
        by_axis = []
        for i, axis in enumerate(AXES):
            powers, excess_rad = self._of_axis("power", row, axis, f, partial(_power_and_phase, row, axis, f))
            strengths = self.strengths[i].copy()
            if self.by_firmware and axis != "thrust":
                strengths[0] *= (float(row["gyro_noise"][i - 1]) / self._gyro_noise()[i - 1]) ** 2
            power = strengths @ powers
            by_axis.append(power * np.exp(UNSTABLE * excess_rad) if excess_rad > 0.0 else power)  # it would not fly
        return np.stack([through_window(m) for m in by_axis], axis=1)


def _power_and_phase(row: Any, axis: str, f: np.ndarray, controller: Controller) -> tuple[np.ndarray, float]:
    """`noise_power` (sources, bins) and `excess_phase`, rad."""
    return noise_power(controller, row, axis, f), excess_phase(controller, row, axis)


def _same_loop(one: Any, two: Any) -> bool:
    """Whether two plant rows have the same roll and pitch loops."""
    return all(np.array_equal(one[k], two[k]) for k in LOOP_FIELDS)
