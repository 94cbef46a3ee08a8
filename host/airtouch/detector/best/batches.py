"""Training batches of `best`: crops of flights, augmented."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from airtouch import kernels, logs
from airtouch.detector.best.outputs import OUTPUTS, training_targets
from airtouch.detector.best.recipe import CHANNELS, ROW_STRIDE, Recipe
from airtouch.detector.evaluation.score import over_platform
from airtouch.detector.shared import sensors
from airtouch.logs.flight_log import FlightLog
from airtouch.reference.motion_channels import CHANNEL_TABLE, NAMES, MotionConfig
from airtouch.vehicle import arm_pwm_of

#: Sign of each column in a left-right mirror: y forces, roll and yaw rates, roll and yaw of the motors turn.
MIRROR = np.array([*(channel.mirror for channel in CHANNEL_TABLE), 1], dtype=np.float32)
FORWARD, LEFT, EMPTY = (NAMES.index(name) for name in ("ax", "ay", "zero"))
#: samples before take-off at which the first of the crops that lie anywhere begins; one of take-off begins up to
#: BEHIND before that
AHEAD = 300
BEHIND = 150  #: samples after the last one of the flight up to which a crop of landing may end


@dataclass(frozen=True)
class TrainingFlight:
    """One training flight of n samples.

    x: (n, channels). targets: (n, outputs). edges: (k,) samples. airborne: (n,) bool. weight: how often it is drawn
    against the others. silent: channels of sensors that it lacks, which stay exactly 0.
    """

    x: np.ndarray
    targets: np.ndarray
    edges: np.ndarray
    airborne: np.ndarray
    weight: float = 1.0
    silent: tuple[int, ...] = field(default=())


def channels_of(log: FlightLog, motion: MotionConfig | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Motion channels (n, channels) and airborne (n,) of a log; those of a missing sensor are 0.

    Raises AirTouchError, naming columns, where more than one sensor is missing.
    """
    logged = sensors.signals(log)
    return kernels.motion_channels(logged.acc, logged.gyro, logged.pwm,
                                   sensors.silence(motion or MotionConfig(), logged.missing))


def flight_of(log: FlightLog, recipe: Recipe, edges: Sequence[logs.Edge] | None = None) -> TrainingFlight:
    """A log as a training flight; its edges are those of its down range (`edges_of`) unless given.

    Flights that pass over the platform at 4 cm or more are drawn more often.
    """
    x, airborne = channels_of(log, recipe.motion)
    edges = edges_of(log, recipe) if edges is None else edges
    high = any(e.kind == "entry" and e.height_after_m >= 0.04 for e in edges)
    silent = {channel for sensor in sensors.missing_sensors(log) for channel in sensors.CHANNELS_OF[sensor]}
    return TrainingFlight(x, training_targets(over_platform(edges, len(log)), edges, recipe),
                          np.array([e.sample for e in edges], dtype=int), airborne, recipe.balance if high else 1.0,
                          tuple(sorted(silent)))


def edges_of(log: FlightLog, recipe: Recipe) -> list[logs.Edge]:
    """The edges of a log's down range, in the air by the recipe's vehicle, else by the one that the log names."""
    return logs.true_edges(log, arm_pwm=recipe.vehicle.arm_pwm if recipe.vehicle else arm_pwm_of(log.meta))


def batch(flights: Sequence[TrainingFlight], recipe: Recipe, rng: np.random.Generator,
          free_air: Sequence[TrainingFlight] = ()) -> tuple[np.ndarray, np.ndarray]:
    """Inputs (batch, crop, channels) and targets (batch, crop / stride, outputs), float32.

    free_air: flights without edges, the source of `recipe.free_air_share` of the crops.
    """
    share = np.array([f.weight for f in flights])
    drawn = [flights[i] for i in rng.choice(len(flights), recipe.batch, p=share / share.sum())]
    x = np.empty((recipe.batch, recipe.crop, CHANNELS), np.float32)
    y = np.empty((recipe.batch, recipe.crop // ROW_STRIDE, len(OUTPUTS)), np.float32)
    silent = _silent(recipe, rng)
    for row, flight in enumerate(drawn):
        if free_air and rng.random() < recipe.free_air_share:
            flight = free_air[int(rng.integers(len(free_air)))]
        x[row], y[row] = _crop(flight, recipe, rng)
        silent[row, list(flight.silent)] = True
    x = _augment(x, recipe, rng)
    np.copyto(x, 0.0, where=silent[:, None])
    return x, y


def _silent(recipe: Recipe, rng: np.random.Generator) -> np.ndarray:
    """(batch, channels) bool: channels held at 0 in each crop, one sensor's at most beside the muted ones."""
    silent = np.zeros((recipe.batch, CHANNELS), bool)
    silent[:, [*recipe.muted, EMPTY]] = True
    draw = rng.random(recipe.batch)
    shares = {sensors.ACCELERATION: recipe.silent_acceleration, sensors.RATES: recipe.silent_rates,
              sensors.MOTORS: recipe.silent_motors}
    low = 0.0
    for sensor, share in shares.items():
        rows = (draw >= low) & (draw < low + share)
        silent[np.ix_(rows, np.array(sensors.CHANNELS_OF[sensor]))] = True
        low += share
    return silent


def _crop(flight: TrainingFlight, recipe: Recipe, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """One crop, its time stretched by up to `warp`; before and after the flight its first and last sample repeat."""
    speed = 1.0 + recipe.warp * rng.uniform(-1, 1)
    last = len(flight.x) - 1
    start = crop_start(flight, recipe, speed, rng)
    t = np.clip(start + speed * np.arange(recipe.crop), 0, last)
    low = np.minimum(t.astype(int), last - 1)
    part = (t - low)[:, None].astype(np.float32)
    x = flight.x[low] * (1 - part) + flight.x[low + 1] * part
    return x, flight.targets[np.round(t[::ROW_STRIDE]).astype(int)]


def crop_start(flight: TrainingFlight, recipe: Recipe, speed: float, rng: np.random.Generator) -> float:
    """Where a crop starts, samples: before an edge, at take-off, at landing, or anywhere in the flight.

    A crop that lies anywhere seldom holds the last second of its flight, so landings are drawn by themselves.
    """
    length = recipe.crop * speed
    first = float(np.argmax(flight.airborne)) - AHEAD
    final = len(flight.x) - 1 - length
    if len(flight.edges) and rng.random() < recipe.edge_share:
        ahead = rng.uniform(1.1 * recipe.warm_up, 0.93 * recipe.crop) * speed
        return float(flight.edges[rng.integers(len(flight.edges))]) - ahead
    # conditional on not being an edge crop, so that `phases` is a share of all crops of a flight with edges; of a
    # flight without edges every crop comes here, and the share is phases / (1 - edge_share)
    if rng.random() < recipe.phases / max(1.0 - recipe.edge_share, recipe.phases):
        return first - BEHIND * rng.random() if rng.random() < 0.5 else final + BEHIND * rng.random()
    return rng.uniform(min(first, final), max(first, final))


def _augment(x: np.ndarray, recipe: Recipe, rng: np.random.Generator) -> np.ndarray:
    """Mirrored, turned, scaled, offset and noisy copies within the limits of the channels."""
    b, n, _ = x.shape
    x *= np.where(rng.random((b, 1, 1)) < recipe.mirror, MIRROR, np.float32(1.0))
    angle = np.radians(recipe.yaw_deg) * rng.uniform(-1, 1, (b, 1))
    ax, ay = x[..., FORWARD].copy(), x[..., LEFT].copy()
    x[..., FORWARD] = np.cos(angle) * ax - np.sin(angle) * ay
    x[..., LEFT] = np.sin(angle) * ax + np.cos(angle) * ay
    gain = rng.standard_normal((b, 1, 1)) + rng.standard_normal((b, 1, CHANNELS))
    x *= np.exp(recipe.gain * gain).astype(np.float32)
    x += (recipe.offset * rng.standard_normal((b, 1, CHANNELS))).astype(np.float32)
    x += np.float32(recipe.noise) * rng.standard_normal((b, n, CHANNELS), dtype=np.float32)
    return np.clip(x, -MotionConfig.limit, MotionConfig.limit, out=x)
