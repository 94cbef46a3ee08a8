"""Tracks of neural-swarm's vehicles: what the forces on each do, and when another vehicle is above it."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.signal import butter, sosfiltfilt

from airtouch import vehicle as vehicles
from airtouch.gap.flights.flight import GROUND, PERIOD_S, Flight, ready
from airtouch.gap.passing import overhead
from airtouch.gap.signals.channels import residual
from airtouch.logs import read

from .. import swarm_cuts

LEAST_S = 0.5  #: s under another vehicle that the data must show; no source: round number
#: Hz above which force is shaking, and band of the yaw torque; no source: round numbers
FORCE_HZ, YAW_HZ = 1.0, (2.0, 20.0)


@dataclass(frozen=True)
class Track:
    """A cut of a log: force along z (n,) over gravity and its fast part, fast yaw torque (n,), usable samples (n,)."""

    row: swarm_cuts.Row
    place: np.ndarray  #: x, y, z, m
    force: np.ndarray
    shaking: np.ndarray
    yaw: np.ndarray
    usable: np.ndarray


def track(folder: Path, row: swarm_cuts.Row) -> Track:
    """The track of one cut in the data's folder."""
    vehicle = vehicles.load(folder / f"{row['vehicle']}.toml")
    flight: Flight = ready(read(folder / "flights" / row["file"]), vehicle)
    unexplained = np.nan_to_num(residual(flight, vehicle))
    usable = flight.usable & ~flight.bridged & (flight.phase != GROUND)
    force = np.where(usable, unexplained[:, 2], 0.0) / vehicle.gravity_mps2
    fast = sosfiltfilt(butter(2, FORCE_HZ, "highpass", fs=1.0 / PERIOD_S, output="sos"), force)
    yaw = sosfiltfilt(butter(2, YAW_HZ, "bandpass", fs=1.0 / PERIOD_S, output="sos"),
                      np.where(usable, unexplained[:, 5], 0.0))
    place = np.column_stack([flight.log[name] for name in overhead.POSITION])
    return Track(row, place, force, fast, yaw, usable)


def under(one: Track, other: Track) -> np.ndarray:
    """Samples (n,) at which another vehicle is above; False where its cut does not reach."""
    shift = -round(swarm_cuts.delay_s(one.row, other.row) / PERIOD_S)
    place = np.full_like(one.place, np.nan)
    index = np.arange(len(place)) + shift
    inside = (index >= 0) & (index < len(other.place))
    place[inside] = other.place[index[inside]]
    return overhead.above(one.place, place)


def overhead_at(one: Track, tracks: list[Track]) -> np.ndarray:
    """Samples (n,) at which any vehicle of the same flight is above, as far as the data hold its path."""
    partners = [t for t in tracks if swarm_cuts.partners(one.row, t.row)]
    return np.logical_or.reduce([np.zeros(len(one.place), bool), *(under(one, t) for t in partners)])


def seconds_under(one: Track, tracks: list[Track]) -> tuple[np.ndarray, float]:
    """Samples (n,) at which another vehicle is above, as far as the data hold its path, and the usable seconds of
    them."""
    acts = overhead_at(one, tracks)
    return acts, float((acts & one.usable).sum() * PERIOD_S)
