"""How unsteadiness and heave in hover follow the corrections of the estimated velocity, on CrazyPAD.

The fit of `hover_balance.ANSWER`: `python tools/diagnosis/gap_crazypad.py FOLDER --corrections`.
"""

from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from airtouch import vehicle as vehicles
from airtouch.gap.balance import hover_balance

from .labels import VEHICLE, family, manifest
from .patterns import hover_patterns

POWER_NAMES = ("unsteady", "heave")  #: of the powers of a `HoverPattern`, as they are printed


def show_corrections(folder: Path) -> None:
    """Print the fit of `hover_balance.ANSWER` to both drones and to each, and the rest of the powers by family."""
    rows = manifest(folder, "build")
    vehicle = vehicles.load(VEHICLE)
    patterns = hover_patterns(folder, rows, vehicle)
    power, corrections = np.array([p.power for p in patterns]), np.array([p.corrections for p in patterns])
    drone = np.array([r["drone"] for r in rows])
    for k, power_name in enumerate(POWER_NAMES):
        for names in (sorted(set(drone)), *([d] for d in sorted(set(drone)))):
            masks = [drone == d for d in names]
            powers, variances = [power[m, k] for m in masks], [10.0 ** corrections[m, k] for m in masks]
            factor, before, after = corrections_fit(powers, variances, float(np.log10(hover_balance.ANSWER[k])))
            print(f"{power_name}, {' and '.join(names)}: 10^{factor:.2f} for one (m/s)^2; deviation between flights "
                  f"{before.std():.2f}, left {after.std():.2f} ({len(before)} flights)")
    normal = np.array([family(r["condition"]) == "normal" for r in rows])
    bases = {d: hover_balance.reference([patterns[i] for i in np.flatnonzero(normal & (drone == d))])
             for d in set(drone)}
    excess = np.array([bases[d].difference(p)[hover_balance.POWER] for d, p in zip(drone, patterns, strict=True)])
    for families in (["rotor damage"], ["added weight", "slung load"]):
        pairs = sorted({(r["condition"], r["drone"]) for r in rows if family(r["condition"]) in families})
        means = np.array([np.mean([a for a, r in zip(excess, rows, strict=True)
                                   if (r["condition"], r["drone"]) == pair], axis=0) for pair in pairs])
        print(f"{' and '.join(families)}, left over the normal flights, {len(pairs)} conditions: " + ", ".join(
            f"{n} {m:.2f} +- {s:.2f}" for n, m, s in zip(POWER_NAMES, means.mean(axis=0),
                                                         means.std(axis=0, ddof=1), strict=True)))


def corrections_fit(powers: list[np.ndarray], corrections: list[np.ndarray], start: float,
                    ) -> tuple[float, np.ndarray, np.ndarray]:
    """log10 of the power for one (m/s)^2 of corrections, and the scatter (flights,) of log10 power before and after.

    powers: log10, (flights,) of each drone; corrections: (flights,) of each drone, (m/s)^2. Each drone has a power of
    its own beside. start: of the first figure, log10.
    """
    def residual(x: np.ndarray) -> np.ndarray:
        """Scatter (flights,) with the drones' own powers x[:-1] and the factor x[-1], all log10."""
        return np.concatenate([y - np.log10(10.0 ** own + 10.0 ** x[-1] * c)
                               for y, own, c in zip(powers, x[:-1], corrections, strict=True)])

    solution = least_squares(residual, [*(y.min() for y in powers), start]).x
    return float(solution[-1]), np.concatenate([y - y.mean() for y in powers]), residual(solution)
