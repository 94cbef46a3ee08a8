"""The paper's baseline (section 7.1): STFT power, Pearson correlations, second derivative.

The raw channels go through the STFT, the power is accumulated over the whole
spectrum at every timestamp, the correlations between the channels' powers are
summed, and an edge is where the second derivative of that sum is zero.
"""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from airtouch import kernels, logs
from airtouch.detector.evaluation import tuning
from airtouch.detector.shared.channels import nine_channels
from airtouch.detector.trace import Detection, Trace
from airtouch.errors import AirTouchError
from airtouch.logs.flight_log import FlightLog
from airtouch.parameters import DEFAULT, SAMPLE_PERIOD_S, Parameters
from airtouch.vehicle import arm_pwm_of

QUANTILES = (0.8, 0.9, 0.95, 0.97, 0.98, 0.99, 0.995, 0.998)  #: of |slope| that `fit` tries as thresholds; chosen


@dataclass(frozen=True)
class Baseline:
    """Settings of the baseline. The paper names none; the defaults are those of `fit` on the authors' 87 clean flights.

    correlation_window: samples over which channels are correlated. smoothing: samples of each of the two means whose
    difference is the derivative. threshold: least first derivative, correlation sum per second, at which a zero of the
    second one is an edge: noise alone crosses zero several times a second. lag_s: median delay in training, seconds.
    """

    correlation_window: int = 100
    smoothing: int = 25
    threshold: float = 54.0
    lag_s: float = 0.29


def run(log: FlightLog, model: Baseline | None = None) -> Trace:
    """Edges of unknown kind ("edge") and no probability. Causal; power through the C kernels."""
    settings = model or Baseline()
    correlation = correlation_sum(spectrum_power(log), settings.correlation_window)
    slope = derivative(correlation, settings.smoothing)
    edges = [Detection(int(s), "edge") for s in extrema(slope, settings.threshold)]
    return Trace(np.full(len(log), np.nan), edges, {"correlation sum": correlation, "derivative": slope})


def fit(flights: Sequence[FlightLog], seed: int = 0, progress: Callable[..., None] | None = None) -> Baseline:
    """The settings of the best timed F1 over the training flights (`tuning.timed_f1`), with their lag.

    seed, progress: what every detector's `fit` takes; here nothing is random, and nothing takes long. Raises TypeError
    for any other option, as the baseline has none.
    """
    truth = [logs.true_edges(log, arm_pwm=arm_pwm_of(log.meta)) for log in flights]
    correlations = [correlation_sum(spectrum_power(log), Baseline.correlation_window) for log in flights]
    slopes = {s: [derivative(c, s) for c in correlations] for s in (25, 50, 100)}
    candidates = [Baseline(smoothing=smoothing, threshold=threshold)
                  for smoothing, of_flights in slopes.items() for threshold in thresholds_of(of_flights)]

    def detect(settings: Baseline, i: int) -> list[Detection]:
        return [Detection(int(s), "edge") for s in extrema(slopes[settings.smoothing][i], settings.threshold)]

    chosen, lag_s, _score = tuning.choose(candidates, truth, detect)
    return replace(chosen, lag_s=lag_s)


def thresholds_of(slopes: Sequence[np.ndarray]) -> list[float]:
    """Thresholds to try: quantiles of the slopes' absolute values over all flights.

    A slope that is not known yet (NaN) counts as 0, as it can pass no threshold.
    """
    sizes = np.abs(np.concatenate([np.nan_to_num(slope) for slope in slopes]))
    return [float(np.quantile(sizes, q)) for q in QUANTILES]


def load(path: Path | None) -> Baseline:
    """The built-in settings; raises AirTouchError for a path: the baseline has no model file."""
    if path is not None:
        raise AirTouchError(f"{path}: the baseline takes no model; leave --model out")
    return Baseline()


def lag_s(model: Baseline | None) -> float:
    """The lag learnt in training, seconds."""
    return (model or Baseline()).lag_s


def parameters(model: Baseline | None) -> dict[str, Any]:
    """The settings by name, for reports."""
    return asdict(model or Baseline())


def spectrum_power(log: FlightLog, pipeline: Parameters = DEFAULT) -> np.ndarray:
    """(n, 9) power of the nine raw channels over the whole spectrum but zero frequency."""
    bin_hz = pipeline.sample_rate_hz / pipeline.band_window
    return kernels.band_power(nine_channels(log), sample_rate_hz=pipeline.sample_rate_hz,
                              window=pipeline.band_window, band_hz=(bin_hz, pipeline.sample_rate_hz / 2))


def correlation_sum(power: np.ndarray, window: int) -> np.ndarray:
    """(n,) sum of Pearson's r over all pairs of columns of power (n, c), last `window` samples, causal.

    NaN before the window is full; a column that is constant in it correlates with none.
    """
    result = np.full(len(power), np.nan)
    known = np.isfinite(power).all(axis=1)
    first = int(np.argmax(known)) if known.any() else len(power)
    if len(power) - first < window:
        return result
    # sum over pairs of z_a . z_b = (|sum of z|^2 - number of columns that vary) / 2
    windows = np.lib.stride_tricks.sliding_window_view(power[first:].astype(np.float64), window, axis=0)
    centred = windows - windows.mean(axis=-1, keepdims=True)
    norm = np.sqrt(np.square(centred).sum(axis=-1, keepdims=True))
    varies = norm > 1e-9 * np.abs(windows).max(axis=-1, keepdims=True)
    z = np.divide(centred, norm, out=np.zeros_like(centred), where=varies)
    result[first + window - 1:] = 0.5 * (np.square(z.sum(axis=1)).sum(axis=-1) - varies.sum(axis=(1, 2)))
    return result


def derivative(values: np.ndarray, smoothing: int) -> np.ndarray:
    """(n,) causal derivative per second: difference of the means of the last two `smoothing` samples.

    NaN until 2 * smoothing finite samples are there.
    """
    result = np.full(len(values), np.nan)
    known = np.flatnonzero(np.isfinite(values))
    if len(known) < 2 * smoothing:
        return result
    first = int(known[0])
    total = np.concatenate([[0.0], np.cumsum(values[first:])])
    means = (total[smoothing:] - total[:-smoothing]) / smoothing
    difference = means[smoothing:] - means[:-smoothing]
    result[first + 2 * smoothing - 1:] = difference / (smoothing * SAMPLE_PERIOD_S)
    return result


def extrema(slope: np.ndarray, threshold: float) -> np.ndarray:
    """Samples at which the second derivative is seen to cross zero while |slope| is above the threshold.

    One sample after the extremum: the first at which it is known. Rising and falling alike.
    """
    step = np.sign(np.diff(slope))  # NaN where unknown: compares as no crossing
    with np.errstate(invalid="ignore"):
        crossing = (step[1:] != step[:-1]) & (step[:-1] * slope[1:-1] > 0) & np.isfinite(step[1:])
        return np.flatnonzero(crossing & (np.abs(slope[1:-1]) >= threshold)) + 2
