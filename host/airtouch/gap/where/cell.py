"""A cell of the gap map, and the map."""

from dataclasses import dataclass
from typing import Any

SMALLEST_FLOOR = 1e-12  #: least floor that a gap is divided by, in a channel's unit; far below any measured


@dataclass(frozen=True)
class Cell:
    """One cell of the gap map: rms in a channel, band and phase, beside the floor.

    regime: the condition beyond the phase ("all", "low", "high voltage", ...); n blocks of
    `flights` flights; interval by block bootstrap over flights.
    """

    channel: str
    band_hz: tuple[float, float]
    phase: str
    gap: float
    floor: float
    unit: str
    low: float | None = None
    high: float | None = None
    regime: str = "all"
    blocks: int = 0
    flights: int = 0
    after: float | None = None  #: the same cell with the named effects in the model
    floor_high: float | None = None  #: upper end of the floor's interval
    by: str | None = None  #: of the named effects the one that alone takes most from it

    @property
    def ratio(self) -> float:
        """The gap over the floor, which is SMALLEST_FLOOR at least."""
        return self.gap / max(self.floor, SMALLEST_FLOOR)

    @property
    def ratio_after(self) -> float:
        """The same with the named effects in the model; without them where none was tried."""
        return (self.gap if self.after is None else self.after) / max(self.floor, SMALLEST_FLOOR)

    @property
    def upper_floor(self) -> float:
        """The upper end of the floor's interval, the floor where it has none; SMALLEST_FLOOR at least."""
        return max(self.floor if self.floor_high is None else self.floor_high, SMALLEST_FLOOR)


BASELINE, SPREAD = "baseline flights", "sensor noise and how these flights differ among themselves"


@dataclass(frozen=True)
class GapMap:
    """Every cell with data, and where the floor is from: BASELINE or SPREAD."""

    cells: tuple[Cell, ...]
    floor_from: str
    flights: tuple[str, ...]


def plain_cell(cell: Cell) -> dict[str, Any]:
    """A cell without the fields that it does not have."""
    return {k: v for k, v in vars(cell).items() if v is not None}
