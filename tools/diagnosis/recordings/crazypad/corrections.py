"""How unsteadiness and heave in hover follow the corrections of the estimated velocity, on CrazyPAD.

The fit of `hover_balance.ANSWER`, which `python tools/diagnosis/gap_crazypad.py FOLDER --corrections` prints.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from airtouch.gap.balance import hover_balance
from airtouch.gap.balance.hover_pattern import HoverPattern

from .labels import family

POWER_NAMES = ("unsteady", "heave")  #: of the powers of a `HoverPattern`


class CorrectionsFit(NamedTuple):
    """How one power of some drones follows the corrections.

    factor: log10 of the power for one (m/s)^2 of corrections; before, after (flights,): scatter of log10 power without
    and with the corrections.
    """

    factor: float
    before: np.ndarray
    after: np.ndarray


@dataclass(frozen=True)
class HoverPowers:
    """Powers in hover with the corrections of the estimated velocity.

    rows: the manifest's; patterns: of each flight.
    """

    rows: Sequence[dict[str, str]]
    patterns: Sequence[HoverPattern]

    @property
    def drone(self) -> np.ndarray:
        """Drone of each flight."""
        return np.array([r["drone"] for r in self.rows])

    def fits(self) -> Iterator[tuple[str, list[str], CorrectionsFit]]:
        """Name of a power, drones, and the fit to them: of each power for all drones together and for each alone."""
        power = np.array([p.power for p in self.patterns])
        corrections = np.array([p.corrections for p in self.patterns])
        drones = sorted(set(self.drone.tolist()))
        for k, power_name in enumerate(POWER_NAMES):
            for names in (drones, *([d] for d in drones)):
                masks = [self.drone == d for d in names]
                powers, variances = [power[m, k] for m in masks], [10.0 ** corrections[m, k] for m in masks]
                yield power_name, names, corrections_fit(powers, variances, float(np.log10(hover_balance.ANSWER[k])))

    def left_over(self, families: Sequence[str]) -> np.ndarray:
        """Mean powers (conditions, 2), log10, of the conditions of these families, less what the fit explains.

        They are relative to the drone's normal flights.
        """
        normal: dict[str, list[HoverPattern]] = {}
        for r, pattern in zip(self.rows, self.patterns, strict=True):
            if family(r["condition"]) == "normal":
                normal.setdefault(r["drone"], []).append(pattern)
        bases = {drone: hover_balance.reference(patterns) for drone, patterns in normal.items()}
        excess: dict[tuple[str, str], list[np.ndarray]] = {}
        for r, pattern in zip(self.rows, self.patterns, strict=True):
            if family(r["condition"]) in families:
                excess.setdefault((r["condition"], r["drone"]), []).append(
                    bases[r["drone"]].difference(pattern)[hover_balance.POWER])
        return np.array([np.mean(excess[condition], axis=0) for condition in sorted(excess)])


def corrections_fit(powers: list[np.ndarray], corrections: list[np.ndarray], start: float,
                    ) -> CorrectionsFit:
    """How a power follows the corrections.

    powers: log10, (flights,) of each drone; corrections: (flights,) of each drone, (m/s)^2. Each drone has a power of
    its own beside. start: of the first figure, log10.
    """
    def residual(x: np.ndarray) -> np.ndarray:
        """Scatter (flights,) with the drones' own powers x[:-1] and the factor x[-1], all log10."""
        return np.concatenate([y - np.log10(10.0 ** own + 10.0 ** x[-1] * c)
                               for y, own, c in zip(powers, x[:-1], corrections, strict=True)])

    solution = least_squares(residual, [*(y.min() for y in powers), start]).x
    return CorrectionsFit(float(solution[-1]), np.concatenate([y - y.mean() for y in powers]), residual(solution))
