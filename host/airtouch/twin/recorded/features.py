"""Features of a flight: trims, spectra and coherency in free air and over the platform, edge-locked means.

Each feature has a unit; differences are measured in its scatter between flights. A feature that a flight
lacks (another height class, a phase that is too short) is NaN.
"""

import functools
from dataclasses import dataclass

import numpy as np

from airtouch.logs.flight_log import PWM, FlightLog
from airtouch.parameters import SAMPLE_RATE_HZ
from airtouch.reference.finite import hold_finite
from airtouch.twin.recorded import channels as ch
from airtouch.twin.recorded.channels import NAMES, channels
from airtouch.twin.recorded.course import OVER, Course

#: bands of spectra in free air, Hz: octaves, above 4 Hz about half ones, from what a block resolves to half of the
#: rate; no other source
BANDS_HZ = ((0.3, 1), (1, 2), (2, 4), (4, 6), (6, 9), (9, 13), (13, 22), (22, 35), (35, 50))
#: bands of spectra over the platform, where blocks are short, Hz: about octaves; no other source
OVER_BANDS_HZ = ((1.5, 4), (4, 9), (9, 20), (20, 45))
#: channels whose coherency shows the loops
PAIRS = ((ch.GYRO_X, ch.ROLL), (ch.GYRO_Y, ch.PITCH), (ch.GYRO_Z, ch.YAW), (ch.AZ, ch.MEAN),
         (ch.AX, ch.PITCH), (ch.AY, ch.ROLL), (ch.AX, ch.GYRO_Y), (ch.AY, ch.GYRO_X))
#: height class -> down range over the platform, m; bounds between the heights of the authors' manifest: low, h79
#: (5 cm), h82 and h85 (7.5 and 8.5 cm)
CLASSES = {"low": (0.0, 0.045), "mid": (0.045, 0.065), "high": (0.065, 0.20)}
#: bins around an edge, s; no source: round numbers, narrow where the answer is
BINS_S = ((-0.4, -0.2), (-0.2, 0.0), (0.0, 0.1), (0.1, 0.2), (0.2, 0.3), (0.3, 0.4), (0.4, 0.5), (0.5, 0.7), (0.7, 1.0))
BASELINE_S = (-1.0, -0.4)  #: s, relative to the entry, of the level that edge-locked means are taken against
LENGTH, OVER_LENGTH = 256, 64  #: samples of a block of a spectrum, in free air and over the platform: 2.56 and 0.64 s
AROUND = (50, 100)  #: samples before and after an edge in `edge_locked`
MIN_VALID = 0.6  #: fraction of a bin's samples that must be there; no source: round number
#: lower bounds of the scatter of edge-locked means, by channel in `channels.UNITS`; no source: round numbers
EDGE_LEAST = (*[0.1] * 3, *[3.0] * 2, 1.5, *[500.0] * 3, 200.0, 0.1, 0.3)
#: groups of features, each with its own misfit
GROUPS = ("trim", "spectrum", "coherency", "over", "entry", "exit")


@dataclass(frozen=True)
class Feature:
    """A feature. group: one of GROUPS. least: lower bound of its scatter, in `unit`; no source: round numbers.

    paired: it depends on the course, so that `least` is its scatter however much the courses differ.
    """

    name: str
    group: str
    unit: str
    least: float
    paired: bool = False


def height_class(clearance_m: float) -> str | None:
    """The height class of a down range over the platform, m; None above the highest class."""
    return next((name for name, (low, high) in CLASSES.items() if low <= clearance_m < high), None)


@functools.cache
def names() -> tuple[Feature, ...]:
    """The features in the order of `features`."""
    out = [Feature("hover PWM", "trim", "PWM", 300.0), Feature("hover PWM slope", "trim", "PWM/s", 5.0),
           Feature("height before the entry", "trim", "cm", 1.0, paired=True)]
    out += [Feature(f"trim {NAMES[k]}", "trim", "PWM", 100.0) for k in (ch.ROLL, ch.PITCH, ch.YAW)]
    out += [Feature(f"{NAMES[k]} {a:g}-{b:g} Hz", "spectrum", "dB", 1.0) for k in range(ch.DOWN) for a, b in BANDS_HZ]
    out += [Feature(f"{NAMES[i]} with {NAMES[k]} {a:g}-{b:g} Hz {part}", "coherency", "1", 0.08)
            for i, k in PAIRS for a, b in BANDS_HZ for part in ("re", "im")]
    out += [Feature(f"{c} {NAMES[k]} {a:g}-{b:g} Hz", "over", "dB", 1.5)
            for c in CLASSES for k in range(ch.DOWN) for a, b in OVER_BANDS_HZ]
    out += [Feature(f"{c} {NAMES[k]} {a:+g}..{b:+g} s", edge, ch.UNITS[k], EDGE_LEAST[k])
            for edge in ("entry", "exit") for c in CLASSES for k in range(12) for a, b in BINS_S]
    return tuple(out)


def features(log: FlightLog, course: Course) -> np.ndarray:
    """The features of a 100 Hz log of a flight over one platform, (len(names()),), in the units of `names`.

    NaN for features that the flight lacks. Raises AirTouchError for columns that the log lacks.
    """
    x = channels(log)
    free = x[course.free]
    parts = [_trims(log, free, course), *_free_spectra(free), _over(x, course)]
    parts += [_edge(x, course, course.entry), _edge(x, course, course.exit)]
    return np.concatenate(parts)


def edge_locked(x: np.ndarray, course: Course, edge: int, before: int = AROUND[0],
                after: int = AROUND[1]) -> np.ndarray:
    """Channels around an edge, (before + after, 12), less their level before the entry (except the down range).

    x: (n, 12) channels. edge: sample. NaN before the log begins, after the landing, and after the exit around an entry.
    """
    start, stop = (course.entry + int(seconds * SAMPLE_RATE_HZ) for seconds in BASELINE_S)
    level = x[start:stop].mean(axis=0)
    level[ch.DOWN] = 0.0
    out = np.full((before + after, 12), np.nan)
    start, stop = max(edge - before, 0), min(edge + after, len(x), course.landing)
    if edge == course.entry:
        stop = min(stop, course.exit)
    out[start - edge + before:stop - edge + before] = x[start:stop] - level
    return out


def _trims(log: FlightLog, free: np.ndarray, course: Course) -> np.ndarray:
    """The features of group "trim"."""
    mean = hold_finite(log.stack(PWM))[0][course.free].mean(axis=1)
    slope = np.polyfit(np.arange(len(mean)) / SAMPLE_RATE_HZ, mean, 1)[0]
    return np.r_[mean.mean(), slope, 100.0 * course.before_m, np.median(free[:, [ch.ROLL, ch.PITCH, ch.YAW]], axis=0)]


def _blocks(x: np.ndarray, length: int, step: int) -> np.ndarray | None:
    """Spectra of detrended, windowed blocks, (blocks, frequencies, channels) complex; None if x is too short."""
    if len(x) < length:
        return None
    starts = np.arange(0, len(x) - length + 1, step)
    pieces = x[starts[:, None] + np.arange(length)]
    t = np.linspace(-1.0, 1.0, length)[:, None]
    pieces = pieces - pieces.mean(axis=1, keepdims=True)
    pieces = pieces - t * (pieces * t).sum(axis=1, keepdims=True) / (t * t).sum()
    return np.fft.rfft(pieces * np.hanning(length)[:, None], axis=1)


def _bins(length: int, bands: tuple) -> list[np.ndarray]:
    """Indices of the frequencies in each band."""
    f = np.fft.rfftfreq(length, 1.0 / SAMPLE_RATE_HZ)
    return [np.flatnonzero((f >= a) & (f < b)) for a, b in bands]


def _free_spectra(free: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The features of groups "spectrum" and "coherency", NaN if the free air is too short."""
    blocks = _blocks(free[:, :ch.DOWN], LENGTH, LENGTH // 2)
    if blocks is None:
        return (np.full(ch.DOWN * len(BANDS_HZ), np.nan), np.full(2 * len(PAIRS) * len(BANDS_HZ), np.nan))
    blocks = _calm(blocks)
    power = (np.abs(blocks) ** 2).mean(axis=0)
    bins = _bins(LENGTH, BANDS_HZ)
    spectrum = [_decibel(power[b].mean(axis=0)) for b in bins]
    coherency = []
    for i, k in PAIRS:
        for b in bins:
            cross = (blocks[:, b, i] * np.conj(blocks[:, b, k])).mean()
            size = np.sqrt((np.abs(blocks[:, b, i]) ** 2).mean() * (np.abs(blocks[:, b, k]) ** 2).mean())
            coherency += [cross.real / max(size, 1e-12), cross.imag / max(size, 1e-12)]
    return np.array(spectrum).T.ravel(), np.array(coherency)


def _calm(blocks: np.ndarray) -> np.ndarray:
    """The half of the blocks (blocks, frequencies, channels) with the least roll and pitch rate: without set-points.

    A hover of the authors is steered by hand, in steps and pulses that no twin repeats (host/docs/twin-findings.md,
    what tells the twin from the drone).
    """
    activity = (np.abs(blocks[:, :, [ch.GYRO_X, ch.GYRO_Y]]) ** 2).sum(axis=(1, 2))
    return blocks[np.argsort(activity)[:(len(blocks) + 1) // 2]]


def _over(x: np.ndarray, course: Course) -> np.ndarray:
    """The features of group "over", NaN in all height classes but the flight's."""
    out = np.full((len(CLASSES), ch.DOWN, len(OVER_BANDS_HZ)), np.nan)
    name = height_class(course.clearance_m)
    blocks = _blocks(x[course.entry + OVER.start:course.exit + OVER.stop, :ch.DOWN], OVER_LENGTH, OVER_LENGTH // 2)
    if name and blocks is not None:
        power = (np.abs(blocks) ** 2).mean(axis=0)
        out[list(CLASSES).index(name)] = np.array([_decibel(power[b].mean(axis=0))
                                                   for b in _bins(OVER_LENGTH, OVER_BANDS_HZ)]).T
    return out.ravel()


def _edge(x: np.ndarray, course: Course, edge: int) -> np.ndarray:
    """The features of one edge, NaN in all height classes but the flight's."""
    out = np.full((len(CLASSES), 12, len(BINS_S)), np.nan)
    name = height_class(course.clearance_m)
    if name:
        locked = edge_locked(x, course, edge)
        for i, (a, b) in enumerate(BINS_S):
            part = locked[AROUND[0] + round(a * SAMPLE_RATE_HZ):AROUND[0] + round(b * SAMPLE_RATE_HZ)]
            if np.isfinite(part[:, 0]).mean() > MIN_VALID:
                out[list(CLASSES).index(name), :, i] = np.nanmean(part, axis=0)
    return out.ravel()


def _decibel(power: np.ndarray) -> np.ndarray:
    """Power in dB."""
    return 10.0 * np.log10(np.maximum(power, 1e-12))
