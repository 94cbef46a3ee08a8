"""The study of a vehicle: the model and the floor that flights are compared with."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np

from airtouch.gap.flights.flight import Flight
from airtouch.gap.loop.closed_loop import ClosedLoop
from airtouch.gap.loop.noise_echo import NominalEcho
from airtouch.gap.signals.channels import residual
from airtouch.gap.signals.floor import Floor
from airtouch.gap.signals.response import Response
from airtouch.gap.signatures.scatter import Scatter
from airtouch.simulation.effects import Active
from airtouch.simulation.effects.effect import Gate
from airtouch.vehicle import Vehicle

if TYPE_CHECKING:  # layers above this one, for types only
    from airtouch.gap.nameless.columns import NamelessFloor
    from airtouch.gap.relations.library import Library


@dataclass(frozen=True, eq=False)
class ScatterOnDemand:
    """A scatter that `measure` gives when it is first asked for: that takes seconds, and not every answer needs it."""

    measure: Callable[[], Scatter]

    @cached_property
    def scatter(self) -> Scatter:
        """The scatter, measured once."""
        return self.measure()


@dataclass(frozen=True)
class Study:
    """What flights are compared with.

    Three stages fill it in, the later ones by a copy. `nominal.build_study`, for every study:

    - vehicle, calibration: the model without effects. The calibration is empty for a vehicle as declared.
    - loop: the control loop as nominal flights show it. None: no nominal flight, or too few blocks of their commands;
      then no command is judged.
    - floor: power of the gap of nominal flights, that of their commands apart (`ClosedLoop.floor`). Without nominal
      flights it is the declared noise of the sensors.
    - response: how the gyro follows the commands of nominal flights. None: no loop, a flight without a gyro, or too
      few blocks; then torque counts in the mean alone.
    - echo: that of the gyro's noise in the commands of nominal flights. None: fewer than two flights with one.
    - nominal_count: number of nominal flights; 0 without a baseline.

    `nominal.calibrate`, once the vehicle is fitted; a study of a vehicle as declared has none of these:

    - nameless_floor: scatter of nominal flights in the nameless model (`nameless.columns.NamelessFloor`). None: that
      model takes them to have no scatter.
    - simulated: whether its nominal flights are those of a simulator, which are all drawn alike. Flights of a study
      without nominal flights, with a single one, or where nobody asks, as for a map, count as recorded.
    - on_demand: how strong effects seem to be in nominal flights, to be read by `scatter`. None: nobody measures it, as
      for a map.
    - relations: what was learned of such flights (`relations.library.Library`). None: recorded flights, or no library
      holds for them; then the replay decides.

    `passing.overhead`, for one flight:

    - overhead: when another vehicle is known to be overhead; the size of its wake is then in the scatter. Empty:
      nobody knows, and such seconds are searched.
    """

    vehicle: Vehicle
    calibration: tuple[Active, ...]
    loop: ClosedLoop | None
    floor: Floor
    response: Response | None = None
    echo: NominalEcho | None = None
    nameless_floor: "NamelessFloor | None" = None
    nominal_count: int = 0
    simulated: bool = False
    on_demand: ScatterOnDemand | None = None
    relations: "Library | None" = None
    overhead: Gate = ()

    def residual(self, flight: Flight, active: Sequence[Active] = ()) -> np.ndarray:
        """Residual (n, COUNT) of a flight, with effects in the model: `channels.residual`."""
        return residual(flight, self.vehicle, (*self.calibration, *active), self.loop)

    @property
    def offset(self) -> np.ndarray:
        """Standard deviation (COUNT,) of a channel's mean in the air from flight to flight, in its unit.

        Simulated flights all have the same trim: what the power in the lowest bin gives their means is no part of it.
        """
        return self.floor.offset_beyond if self.simulated else self.floor.offset

    @property
    def scatter(self) -> Scatter | None:
        """How strong effects seem to be in nominal flights; None where nobody measures it."""
        return None if self.on_demand is None else self.on_demand.scatter

    def with_scatter(self, scatter: Scatter) -> "Study":
        """The study with a scatter that is known already; whether it is of simulated flights goes with it."""
        return replace(self, simulated=scatter.exact, on_demand=ScatterOnDemand(partial(_known, scatter)))

    @property
    def same_models(self) -> bool:
        """Whether the loop is this project's firmware as well, so that every model is the simulator's own."""
        return self.simulated and self.loop is not None and self.loop.by_firmware


def _known(scatter: Scatter) -> Scatter:
    """A scatter as what `ScatterOnDemand` asks; a function of this module, so that a study can be sent elsewhere."""
    return scatter
