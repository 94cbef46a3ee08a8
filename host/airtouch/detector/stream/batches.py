"""Training batches of the streaming network: crops of flights, augmented."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from airtouch import kernels, logs
from airtouch.detector.channels import level_acceleration
from airtouch.detector.score import over_platform
from airtouch.detector.stream.recipe import CHANNELS, ENTRY, EXIT, OUTPUTS, OVER, STRIDE, Recipe
from airtouch.logs.flight_log import GYRO, PWM, FlightLog
from airtouch.reference.motion_channels import MotionConfig

#: Sign of each channel in a left-right mirror: y forces, roll and yaw rates, roll and yaw of the motors turn.
MIRROR = np.array([1, -1, 1, -1, 1, -1, -1, 1, -1, 1, 1, 1], dtype=np.float32)


@dataclass(frozen=True)
class Flight:
    """One training flight: x (n, 12) channels, goals (n, 3), edges (k,) samples, airborne (n,), and how
    often it is drawn."""

    x: np.ndarray
    goals: np.ndarray
    edges: np.ndarray
    airborne: np.ndarray
    weight: float = 1.0


def channels_of(log: FlightLog, motion: MotionConfig | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Motion channels (n, 12) and airborne (n,) of a log; AirTouchError that names missing columns."""
    return kernels.motion_channels(level_acceleration(log), log.stack(GYRO), log.stack(PWM), motion)


def flight_of(log: FlightLog, recipe: Recipe) -> Flight:
    """A log as a training flight. Flights that pass over the platform at 4 cm or more are drawn more often."""
    x, airborne = channels_of(log, recipe.motion)
    edges = logs.true_edges(log)
    high = any(e.kind == "entry" and e.height_after_m >= 0.04 for e in edges)
    return Flight(x, goals(over_platform(edges, len(log)), edges, recipe),
                  np.array([e.sample for e in edges], dtype=int), airborne, recipe.balance if high else 1.0)


def goals(over: np.ndarray, edges: Sequence[logs.Edge], recipe: Recipe) -> np.ndarray:
    """What the three logits are to say at each sample, (n, 3) in 0..1.

    over: (n,) 0 or 1. The events are bumps of height 1 `delay` samples after their edge.
    """
    n = len(over)
    wanted = np.zeros((n, OUTPUTS), np.float32)
    wanted[recipe.over_delay:, OVER] = over[:n - recipe.over_delay]
    t = np.arange(n)
    for edge in edges:
        bump = np.exp(-0.5 * np.square((t - edge.sample - recipe.delay) / recipe.event_sigma))
        column = ENTRY if edge.kind == "entry" else EXIT
        wanted[:, column] = np.maximum(wanted[:, column], bump)
    return wanted


def batch(flights: Sequence[Flight], recipe: Recipe, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Inputs (batch, crop, 12) float32 and goals (batch, crop / 2, 3) float32."""
    share = np.array([f.weight for f in flights])
    drawn = rng.choice(len(flights), recipe.batch, p=share / share.sum())
    x = np.empty((recipe.batch, recipe.crop, CHANNELS), np.float32)
    y = np.empty((recipe.batch, recipe.crop // STRIDE, OUTPUTS), np.float32)
    for row, index in enumerate(drawn):
        x[row], y[row] = _crop(flights[index], recipe, rng)
    return _augment(x, recipe, rng), y


def _crop(flight: Flight, recipe: Recipe, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """One crop, its time stretched by up to `warp`; short flights repeat their first and last sample."""
    speed = 1.0 + recipe.warp * rng.uniform(-1, 1)
    last = len(flight.x) - 1
    if len(flight.edges) and rng.random() < recipe.edge_share:
        ahead = rng.uniform(1.1 * recipe.warm_up, 0.93 * recipe.crop) * speed
        start = flight.edges[rng.integers(len(flight.edges))] - ahead
    else:
        first = float(np.argmax(flight.airborne)) - 300.0
        start = rng.uniform(min(first, last - recipe.crop * speed), max(first, last - recipe.crop * speed))
    t = np.clip(start + speed * np.arange(recipe.crop), 0, last)
    low = np.minimum(t.astype(int), last - 1)
    part = (t - low)[:, None].astype(np.float32)
    x = flight.x[low] * (1 - part) + flight.x[low + 1] * part
    return x, flight.goals[np.round(t[::STRIDE]).astype(int)]


def _augment(x: np.ndarray, recipe: Recipe, rng: np.random.Generator) -> np.ndarray:
    """Mirrored, turned, scaled, offset and noisy copies within the limits of the channels."""
    b, n, _ = x.shape
    x = x * np.where(rng.random((b, 1, 1)) < recipe.mirror, MIRROR, np.float32(1.0))
    angle = np.radians(recipe.yaw_deg) * rng.uniform(-1, 1, (b, 1))
    ax, ay = x[..., 0].copy(), x[..., 1].copy()
    x[..., 0], x[..., 1] = np.cos(angle) * ax - np.sin(angle) * ay, np.sin(angle) * ax + np.cos(angle) * ay
    x *= np.exp(recipe.gain * (rng.standard_normal((b, 1, 1)) + rng.standard_normal((b, 1, CHANNELS))))
    disturbed = x + recipe.offset * rng.standard_normal((b, 1, CHANNELS))
    disturbed += recipe.noise * rng.standard_normal((b, n, CHANNELS), dtype=np.float32)
    disturbed[..., [*recipe.muted, CHANNELS - 1]] = 0.0
    return np.clip(disturbed, -MotionConfig.limit, MotionConfig.limit).astype(np.float32)
