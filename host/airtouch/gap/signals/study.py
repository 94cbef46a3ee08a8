"""The study of a vehicle: the model and the floor that flights are compared with."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from airtouch.gap.flights.flight import Flight
from airtouch.gap.loop.closed_loop import ClosedLoop
from airtouch.gap.signals.channels import residual
from airtouch.gap.signals.response import Response
from airtouch.gap.signals.spectra import Floor
from airtouch.gap.signatures.scatter import Scatter
from airtouch.simulation.effects import Active
from airtouch.simulation.effects.effect import Gate
from airtouch.vehicle import Vehicle

if TYPE_CHECKING:  # layers above this one, for types only
    from airtouch.gap.nameless.columns import NamelessFloor
    from airtouch.gap.relations.library import Library


@dataclass(frozen=True)
class Study:
    """What flights are compared with.

    vehicle, calibration: the model without effects; controller: the control loop as nominal flights show it, None
    without them; floor: power of the gap of nominal flights; response: how the gyro follows their commands, None where
    nobody knows; nameless_floor: scatter of nominal flights in the nameless model (`nameless.columns.NamelessFloor`);
    nominal_count: number of nominal flights; scatter: how strong effects seem to be in them, None without any;
    relations: what was learned of such flights (`relations.library.Library`), if anything; overhead: when another
    vehicle is known to be overhead, none where nobody knows.
    """

    vehicle: Vehicle
    calibration: tuple[Active, ...]
    controller: ClosedLoop | None
    floor: Floor
    response: Response | None = None
    nameless_floor: "NamelessFloor | None" = None
    nominal_count: int = 0
    scatter: Scatter | None = None
    relations: "Library | None" = None
    overhead: Gate = ()

    def residual(self, flight: Flight, active: Sequence[Active] = ()) -> np.ndarray:
        """Measured minus modelled (n, COUNT) of a flight, with effects in the model: `channels.residual`."""
        return residual(flight, self.vehicle, (*self.calibration, *active), self.controller)

    @property
    def simulated(self) -> bool:
        """Whether its nominal flights are those of a simulator, which are all drawn alike."""
        return self.scatter is not None and self.scatter.exact

    @property
    def same_models(self) -> bool:
        """Whether the loop is this project's firmware as well, so that every model is the simulator's own."""
        return self.simulated and self.controller is not None and self.controller.by_firmware

    @property
    def recorded(self) -> bool:
        """Whether its nominal flights are not known to be a simulator's; one flight alone is not.

        Without nominal flights this is False, as `simulated` is.
        """
        return self.scatter is not None and not self.scatter.exact
