"""Faults of single channels: duplicates, stuck values, saturation, spikes."""

import numpy as np

from airtouch.logs.checks.clock import sample_period
from airtouch.logs.flight_log import ACC, ACC_WORLD, ATTITUDE, AXES, GYRO, PWM, RANGES, FlightLog
from airtouch.robust import MAD_TO_SIGMA

STUCK_S = 0.5  #: s; a sensor or motor value that does not change for longer in flight is stuck
GYRO_LIMIT = np.deg2rad(2000.0)  #: rad/s, full scale of the BMI088's gyro as the firmware configures it
ACC_FULL_SCALE = 24 * 9.81  #: m/s^2, full scale of its accelerometer
INT16_LIMIT = 32.767  #: m/s^2, largest acceleration that an int16 in mm/s^2 can hold
PWM_LIMIT = 65535.0
#: least height of a spike in the channel's unit: far above noise and manoeuvres
SPIKE_FLOOR = {**dict.fromkeys(ACC + ACC_WORLD, 5.0), **dict.fromkeys(GYRO, 3.0),
               **dict.fromkeys(("zrange_m", *RANGES), 0.3), **dict.fromkeys(ATTITUDE[:2], 0.3),
               **dict.fromkeys((f"{a}_m" for a in AXES), 0.3), "vbat_V": 0.3}
SPIKE_NOISE = 12.0  #: least height of a spike in multiples of the channel's sample-to-sample noise


def duplicates(log: FlightLog) -> list[tuple[str, str]]:
    """Pairs of channels that are equal up to scale and offset.

    World accelerations that stand in for missing body accelerations are no fault.
    """
    if len(log) < 3:
        return []
    names = [name for name in log.columns if name != "t_s"]
    values = np.array([log.columns[name] for name in names]).reshape(len(names), len(log))
    with np.errstate(over="ignore", invalid="ignore"):
        centred = values - values.mean(axis=1, keepdims=True)
        norm = np.linalg.norm(centred, axis=1)
        moves = np.isfinite(values).all(axis=1) & (np.ptp(values, axis=1) > 0) & np.isfinite(norm) & (norm > 0)
    names = [name for name, one in zip(names, moves, strict=True) if one]
    columns = centred[moves] / norm[moves, None]
    similarity = np.abs(columns @ columns.T)
    allowed = set(zip(ACC, ACC_WORLD, strict=True))
    pairs = []
    for i, j in zip(*np.nonzero(np.triu(similarity > 1 - 1e-12, 1)), strict=True):
        pair = (names[i], names[j])
        if not (pair in allowed or pair[::-1] in allowed):
            pairs.append(pair)
    return _without_copies(pairs, log)


def _without_copies(pairs: list[tuple[str, str]], log: FlightLog) -> list[tuple[str, str]]:
    """The pairs without those that contain `acc_*`, where `acc_*` repeat the world accelerations."""
    if log.meta.get("acc_frame") != "world":
        return pairs
    return [pair for pair in pairs if not set(pair) & set(ACC)]


def stuck_intervals(log: FlightLog, flying: np.ndarray) -> list[tuple[str, int, int]]:
    """Intervals of samples (channel, start, stop) in which a channel does not change.

    Any channel that is constant over the whole log; and in flight motors, rates and accelerations
    that are constant for more than 0.5 s, and rotor speeds for more than 1 s. flying: (n,) bool.
    """
    period = sample_period(log)
    limits = {**dict.fromkeys(ACC + ACC_WORLD + GYRO + PWM, STUCK_S),
              **{name: 2 * STUCK_S for name in log.columns if name.startswith("rpm_")}}
    intervals = []
    for name, values in log.columns.items():
        if len(values) < 2:
            continue
        if np.all(values == values[0]):
            intervals.append((name, 0, len(values)))
        elif name in limits:
            moves = (np.diff(values) != 0) | ~flying[1:] | ~flying[:-1]
            bounds = np.concatenate(([0], np.flatnonzero(moves) + 1, [len(values)]))
            for start in np.flatnonzero(np.diff(bounds) * period > limits[name]):
                intervals.append((name, int(bounds[start]), int(bounds[start + 1])))
    return intervals


def saturation_counts(log: FlightLog) -> dict[str, int]:
    """Number of samples at full scale or beyond, by channel; channels without any are absent."""
    limits = {**dict.fromkeys(PWM, PWM_LIMIT), **dict.fromkeys(GYRO, 0.999 * GYRO_LIMIT),
              **dict.fromkeys(ACC, 0.999 * ACC_FULL_SCALE)}
    counts = {name: int((np.abs(log[name]) >= limit).sum())
              for name, limit in limits.items() if log.has(name)}
    for name in ACC_WORLD:
        if log.has(name):
            counts[name] = int(np.isclose(np.abs(log[name]), INT16_LIMIT, rtol=0, atol=1.1e-3).sum())
    return {name: count for name, count in counts.items() if count}


def spikes(log: FlightLog) -> dict[str, list[int]]:
    """Indices of spikes, by channel: single samples far from both neighbours, which agree with each other.

    Motors are not tested: steps of the set point make real spikes in their commands.
    """
    names = [name for name in SPIKE_FLOOR if name in log.columns]
    if not names or len(log) < 5:
        return {}
    floors = np.array([SPIKE_FLOOR[name] for name in names])
    with np.errstate(invalid="ignore", over="ignore"):
        steps = np.diff([log.columns[name] for name in names])
        left, right = steps[:, :-1], -steps[:, 1:]
        limits = np.maximum(floors, SPIKE_NOISE * MAD_TO_SIGMA * _medians(np.abs(left)))[:, None]
        out = (np.minimum(np.abs(left), np.abs(right)) > limits) & (left * right > 0)
        out &= np.abs(left - right) < limits / 3
    return {name: (np.flatnonzero(one) + 1).tolist() for name, one in zip(names, out, strict=True) if one.any()}


def _medians(values: np.ndarray) -> np.ndarray:
    """The median of each row of (k, n), NaN ignored, (k,); 0 for a row that is all NaN."""
    ordered = np.sort(values, axis=1)  # NaN come last
    count = (~np.isnan(values)).sum(axis=1)
    below, above = np.maximum(count - 1, 0) // 2, count // 2
    rows = np.arange(len(values))
    return np.where(count > 0, 0.5 * (ordered[rows, below] + ordered[rows, np.minimum(above, values.shape[1] - 1)]),
                    0.0)
