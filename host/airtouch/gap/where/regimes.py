"""Regimes of a flight: how high and fast it flies, with what voltage, in which third of its time in the air."""

import numpy as np

from airtouch.gap.flights.flight import GROUND, Flight
from airtouch.simulation import signals as at
from airtouch.vehicle import Vehicle

#: names of the thirds of a flight, by its time in the air
THIRDS = ("first", "second", "last")
#: regimes beside "all" and the thirds: the quantity, its unit, the two limits between its three bins; chosen
BINS = (("height", "m", (0.1, 0.3)), ("speed", "m/s", (0.15, 0.5)), ("cell voltage", "V", (3.6, 3.9)))


def _regime_names() -> tuple[str, ...]:
    """Names of the regimes, in the order of their columns."""
    names = ["all"]
    for quantity, unit, (low, high) in BINS:
        names += [f"{quantity} {limits} {unit}" for limits in (f"< {low:g}", f"{low:g}-{high:g}", f"> {high:g}")]
    return (*names, *(f"{third} third of the flight" for third in THIRDS))


REGIMES = _regime_names()  #: names of the regimes; column r of every array over regimes belongs to REGIMES[r]


def regimes(flight: Flight, vehicle: Vehicle) -> np.ndarray:
    """Membership of every sample in each of REGIMES, bool (n, r); samples on the ground are in "all" alone."""
    n, log = len(flight), flight.log
    out = np.zeros((n, len(REGIMES)), bool)
    out[:, 0] = True
    air = flight.phase != GROUND
    quantities = {
        "height": flight.signals[:, at.LOWER_HEIGHT:at.LOWER_HEIGHT + 4].mean(axis=1)
        if log.has("zrange_m") or log.has("z_m") else None,
        "speed": np.hypot(log["vx_mps"], log["vy_mps"]) if log.has("vx_mps", "vy_mps") else None,
        "cell voltage": log["vbat_V"] / vehicle.battery_cells if log.has("vbat_V") else None,
    }
    for i, (quantity, _, limits) in enumerate(BINS):
        value = quantities[quantity]
        if value is not None:
            bin_index = np.where(np.isfinite(value), np.digitize(value, limits), -1)
            for k in range(3):
                out[:, 1 + 3 * i + k] = air & (bin_index == k)
    third = np.minimum(3 * np.cumsum(air) // max(int(air.sum()) + 1, 1), 2)
    for k in range(3):
        out[:, 1 + 3 * len(BINS) + k] = air & (third == k)
    return out
