"""The loops of nominal flights, and what they are under a hypothesis: power of the commands, share of their torque.

Noise that no log holds drives the controller, so commands cannot be predicted sample by sample; their spectra can.
Flights declared nominal give the spectra of level flight and, by `identify`, the controller and its noise. A
hypothesis multiplies these spectra by S_uu of the loop model under it, over S_uu under none (`ClosedLoop.ratio`).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import NamedTuple, TypeVar

import numpy as np

from airtouch.gap.edges.edge_response import EdgeFloor
from airtouch.gap.flights.flight import PERIOD_S, Flight
from airtouch.gap.flights.hardness import Slopes, hardness_of
from airtouch.gap.loop.axis_plant import PlantRow, axis_plant
from airtouch.gap.loop.command_response import fitted_step
from airtouch.gap.loop.command_spectra import (
    COMMAND_LENGTH,
    block_spectra,
    command_frequencies,
    commands,
    fine_frequencies,
    through_window,
)
from airtouch.gap.loop.controller import AXES, TURNING, Controller, firmware_of
from airtouch.gap.loop.loop_model import AxisLoop, excess_phase, torque_per_command
from airtouch.gap.loop.noise_spectra import noise_power
from airtouch.gap.loop.set_point_steps import NO_STEP, Step
from airtouch.gap.loop.torque_share import AxisTorque, Change, axis_torque, change_of
from airtouch.gap.workspace import Workspace
from airtouch.simulation.effects import Active
from airtouch.simulation.flight import prepare
from airtouch.vehicle import Vehicle

Made = TypeVar("Made")
#: Nepers of command power added per rad of phase beyond stability, so that a loop that could not fly fits no flight;
#: chosen.
UNSTABLE = 30.0
#: fields of the plant that make the roll and pitch loops, not their noise; not `gain`, though it scales the plant:
#: effects on thrust show in the replayed force, and are not judged as changes of the loop (`ratio` has gain in it)
LOOP_FIELDS = ("sensor_delay", "actuator_delay", "rate_gain", "attitude_gain", "position_gain", "motor_rise",
               "motor_fall", "inertia", "rate_scale", "gyro_lowpass", "gyro_bandwidth", "rotor_x", "rotor_y")
PLANTS = 500  #: hypotheses whose plant is cached, chosen by memory: about 2 kB each
LEAST_NOISE_RADPS = 1e-9  #: rad/s, of a gyro that another is divided by
LOOPS = 1000  #: spectra of an axis that are cached, chosen by memory: about 10 kB each


class PlantUnderEffects(NamedTuple):
    """A plant row with effects, not to be changed, and whether they change the roll and pitch loops."""

    row: PlantRow
    changes_loop: bool


@dataclass(frozen=True)
class ClosedLoop:
    """The loops of nominal flights, of each of AXES.

    calibration: effects that make the vehicle as declared the nominal one; controllers: the firmware's (by_firmware)
    or ones fitted to the flights; strengths (sources,) each: of the noise, sources as in `noise_spectra.noise_power`;
    floor (bins, AXES): PSD of the commands, N^2/Hz, of `blocks` blocks as hard as nominal ones; slopes: of its power
    with how hard the vehicle is flown; edges: responses at edges, None where nominal flights cross none; steps: of the
    set-points of roll and pitch, in blocks in which one stepped.
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
        return first, spectra / np.sqrt(self.slopes.relative_power(hardness_of(flight, first, COMMAND_LENGTH)))

    def ratio(self, active: Sequence[Active]) -> np.ndarray:
        """Expected power of the commands over that of nominal flights, (bins, AXES)."""
        row = self._plant(active).row
        key = row.tobytes()
        return self.workspace.cached("ratio", key, lambda: self._power(row) / self.nominal_power(), PLANTS)

    def torque_change(self, active: Sequence[Active], f: np.ndarray) -> Change | None:
        """How effects change what the vehicle does upon a logged command; None where they leave the loop as it is."""
        row, changed = self._plant(active)
        if not changed:
            return None

        def make() -> Change:
            """The change at the frequencies."""
            loop = self._loops(self._nominal_row)[AXES.index("roll")]
            return change_of(loop, self._torques(self._nominal_row, f), self._torques(row, f), f)

        return self.workspace.cached("change", (row.tobytes(), f.tobytes()), make, PLANTS)

    def changes_loop(self, active: Sequence[Active]) -> bool:
        """Whether effects change the roll and pitch loops."""
        return self._plant(active).changes_loop

    def same_loop(self, one: Sequence[Active], other: Sequence[Active]) -> bool:
        """Whether the roll and pitch loops are the same under two hypotheses."""
        return _same_loop(self._plant(one).row, self._plant(other).row)

    def commands_without(self, flight: Flight, active: Sequence[Active]) -> np.ndarray:
        """Commands (n, 4), N per motor, freed of what the effects did to their spectra."""
        logged = commands(flight, self.vehicle)
        ratio = self.ratio(active)
        if np.all(ratio == 1.0):
            return logged
        f = np.fft.rfftfreq(len(logged), PERIOD_S)
        spectrum = np.fft.rfft(logged, axis=0)
        for i in range(len(AXES)):
            spectrum[:, i] /= np.sqrt(np.interp(f, command_frequencies(), ratio[:, i]))
        return np.fft.irfft(spectrum, len(logged), axis=0)

    def nominal_power(self) -> np.ndarray:
        """Power of the commands (bins, AXES) that the model makes of the vehicle as calibrated."""
        return self.workspace.cached("power", (), lambda: self._power(self._nominal_row))

    def with_steps(self, share: np.ndarray, excess: np.ndarray, f: np.ndarray) -> "ClosedLoop":
        """The same loop with `steps`, from blocks of nominal flights in which a set-point stepped.

        share (bins, 3): of the commanded torque, what turned the vehicle, 0 where it is not known; excess (bins, 3):
        power of these torques over that of other blocks.
        """
        if not self.by_firmware:
            return replace(self)

        def of_axis(axis: str) -> Step:
            """The steps of the set-point of an axis, one of TURNING."""
            i, turn = AXES.index(axis), TURNING.index(axis)
            loop = self._loops(self._nominal_row)[i]
            measured = share[:, turn] * torque_per_command(loop.firmware, loop.plant, f)
            return fitted_step(loop.firmware, loop.plant, self.strengths[i], f, excess[:, turn], measured)

        return replace(self, steps=(of_axis("roll"), of_axis("pitch")))

    @cached_property
    def _nominal_row(self) -> PlantRow:
        """Plant row of the vehicle as calibrated."""
        return prepare(self.vehicle, self.calibration)[0][0]

    def _plant(self, active: Sequence[Active]) -> PlantUnderEffects:
        """The vehicle as calibrated, with effects; cached."""
        def make() -> PlantUnderEffects:
            """The plant row with effects."""
            row = prepare(self.vehicle, (*self.calibration, *active))[0][0]
            return PlantUnderEffects(row, not _same_loop(row, self._nominal_row))

        return self.workspace.cached("plant", tuple(a.key for a in active), make, PLANTS)

    def _loops(self, row: PlantRow) -> list[AxisLoop]:
        """The loops of AXES under a plant row; cached."""
        def make() -> list[AxisLoop]:
            """The loops, one for each of AXES."""
            by_firmware = firmware_of(row)
            controllers = by_firmware if self.by_firmware else self.controllers
            return [AxisLoop(axis_plant(row, axis), own, c)
                    for axis, own, c in zip(AXES, by_firmware, controllers, strict=True)]

        return self.workspace.cached("loops", row.tobytes(), make, PLANTS)

    def _torques(self, row: PlantRow, f: np.ndarray) -> list[AxisTorque]:
        """Torques of commands about roll and pitch at frequencies f, cached for all plant rows with the same loop."""
        nominal, loops = self._loops(self._nominal_row), self._loops(row)
        torques = []
        for axis, step in zip(TURNING, self.steps, strict=True):
            i = AXES.index(axis)
            make = partial(axis_torque, loops[i], nominal[i].plant, self.strengths[i], step, f)
            torques.append(self._once_a_loop("torque", loops[i], f, make))
        return torques

    def _once_a_loop(self, what: str, loop: AxisLoop, f: np.ndarray, make: Callable[[], Made]) -> Made:
        """A value of a loop at frequencies f, the same for all plant rows with that loop; cached."""
        return self.workspace.cached("axis", (what, loop, f.tobytes()), make, LOOPS)

    def _power(self, row: PlantRow) -> np.ndarray:
        """Modelled power of the commands (bins, AXES) of a plant row, N^2/Hz; far above any where it would not fly."""
        f = fine_frequencies()
        by_axis = []
        for i, loop in enumerate(self._loops(row)):
            powers, excess_rad = self._once_a_loop("power", loop, f, partial(_power_and_phase, loop, f))
            strengths = self.strengths[i].copy()
            if self.by_firmware and loop.plant.axis in TURNING:
                turn = TURNING.index(loop.plant.axis)
                strengths[0] *= (float(row["gyro_noise"][turn]) / self._gyro_noise()[turn]) ** 2
            power = strengths @ powers
            by_axis.append(power * np.exp(UNSTABLE * excess_rad) if excess_rad > 0.0 else power)  # it would not fly
        return np.stack([through_window(m) for m in by_axis], axis=1)

    def _gyro_noise(self) -> np.ndarray:
        """Rms (3,) of the calibrated gyro's noise, rad/s."""
        return np.maximum(self._nominal_row["gyro_noise"], LEAST_NOISE_RADPS)


def _power_and_phase(loop: AxisLoop, f: np.ndarray) -> tuple[np.ndarray, float]:
    """`noise_power` (sources, bins) and `excess_phase`, rad."""
    return noise_power(loop.controller, loop.plant, f), excess_phase(loop.controller, loop.plant)


def _same_loop(one: PlantRow, two: PlantRow) -> bool:
    """Whether two plant rows have the same roll and pitch loops."""
    return all((one[k] == two[k]).all() for k in LOOP_FIELDS)
