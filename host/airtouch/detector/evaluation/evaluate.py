"""A detector over many flights: bad ones set aside, the others scored."""

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from airtouch import logs
from airtouch.detector.evaluation import summary
from airtouch.detector.evaluation.data.dataset import FlightFile, with_flown_speed
from airtouch.detector.evaluation.score import FlightScore, score_flight
from airtouch.detector.registry import Detector, model_for
from airtouch.detector.shared import sensors, training_set
from airtouch.detector.shared.channels import ACCELERATIONS, RATES, logged_channels
from airtouch.detector.trace import Trace
from airtouch.errors import AirTouchError
from airtouch.logs.checks.clock import lost_samples, sample_period, true_period
from airtouch.logs.checks.quality import clock_steps, nothing_logged
from airtouch.logs.flight_log import FlightLog
from airtouch.logs.in_flight import flies_below
from airtouch.parameters import SAMPLE_PERIOD_S
from airtouch.vehicle import arm_pwm_of

SHORTEST_S = 4.0  #: s: the windows of the band power (2 s) and of the network (1 s), and one second in the air
LONG_HOLE_S = 1.0  #: s without a sample, the window of the network, from which a hole gets a remark
MOST_LOST = 0.01  #: share of all samples that may be lost without a remark: that of a clean flight of `collect`
MOST_MISSING = 0.1  #: share of a channel's samples that may be NaN, which hold the last value; chosen


@dataclass(frozen=True)
class Result:
    """One flight with the detector's trace of it and the trace's score."""

    log: FlightLog
    trace: Trace
    score: FlightScore


def read_flight(file: FlightFile, spare: int = 0, arm_pwm: float | None = None) -> FlightLog:
    """A log that can be scored; arguments as in `check`. Raises AirTouchError with the reason and the remedy."""
    log = read_usable(file, spare, arm_pwm)
    if truth(log) and with_flown_speed(file, log).condition.speed_mps is None:
        raise AirTouchError(f"{file.path}: speed unknown, so errors in metres are too: "
                            "give --speed, or speed_mps in a manifest.csv beside the flight")
    return log


def read_usable(file: FlightFile, spare: int = 0, arm_pwm: float | None = None) -> FlightLog:
    """A log that a detector can use; arguments as in `check`. Raises AirTouchError with the reason and the remedy."""
    log = logs.read(file.path)
    check(log, spare, arm_pwm)
    return log


def spare_of(detector: Detector) -> int:
    """How many of the three sensors a detector can do without: its SPARE_SENSORS, else none."""
    return getattr(detector, "SPARE_SENSORS", 0)


def arm_pwm_by(detector: Detector, model: Any = None) -> float | None:
    """Mean PWM above which a detector with this model reports edges: its arm_pwm; None where it has none of its own.

    It then goes by the vehicle that the log names.
    """
    own = getattr(detector, "arm_pwm", None)
    return own(model) if own else None


def check(log: FlightLog, spare: int = 0, arm_pwm: float | None = None) -> None:
    """Raise AirTouchError, one line with the remedy, for a log that a detector cannot use.

    spare: sensors of the three that the detector can do without (`spare_of`). arm_pwm: mean PWM above which it takes
    the vehicle to be in the air (`arm_pwm_by`); that of the log's vehicle for None.
    """
    arm_pwm = arm_pwm_of(log.meta) if arm_pwm is None else arm_pwm
    period = sample_period(log)
    if abs(period - SAMPLE_PERIOD_S) > 0.02 * SAMPLE_PERIOD_S:
        raise AirTouchError(f"{log.source}: logged at {1 / period:.4g} Hz, the detectors need 100 Hz: "
                            "airtouch logs convert --rate 100")
    if nothing_logged(log):
        raise AirTouchError(f"{log.source}: nothing was logged: every value of every channel is missing (NaN)")
    names, channels = logged_channels(log, sensors.missing_sensors(log) if spare else ())
    if spare:
        sensors.signals(log)  # names what is missing, where that is too much
    if len(log) * SAMPLE_PERIOD_S < SHORTEST_S:
        raise AirTouchError(f"{log.source}: {len(log) * SAMPLE_PERIOD_S:.2f} s of data (it may be cut off); "
                            f"at least {SHORTEST_S:g} s are needed")
    finite = np.isfinite(channels)
    for name, missing in zip(names, 1.0 - finite.mean(axis=0), strict=True):
        if missing > MOST_MISSING:
            raise AirTouchError(f"{log.source}: {name} is missing (NaN) in {missing:.0%} of the samples; "
                                "log the flight again or leave it out")
    flying, evidence = sensors.airborne_by(log, arm_pwm)
    airborne_s = 0.0 if flies_below(log, arm_pwm) else np.count_nonzero(flying) * SAMPLE_PERIOD_S
    if airborne_s < 1.0:  # the detectors go by the motors alone
        raise AirTouchError(f"{log.source}: no flight in this log (less than 1 s of {evidence})")
    used = np.where(finite, channels, 0.0)[flying]
    for name, values, logged in zip(names, used.T, finite[flying].T, strict=True):
        if not logged.any() or np.ptp(values[logged]) == 0.0:
            raise AirTouchError(f"{log.source}: {name} is constant in flight; the sensor or the log is stuck")
    for rate, acceleration in zip(RATES, ACCELERATIONS, strict=True):
        if {rate, acceleration} <= set(names):
            pair = used[:, names.index(rate)], used[:, names.index(acceleration)]
            if np.corrcoef(*pair)[0, 1] > 0.999999:
                raise AirTouchError(f"{log.source}: {rate} is a copy of {acceleration}; log the gyro or leave it out")


def remarks(log: FlightLog) -> list[str]:
    """Warnings of the reader, and faults of the clock, from which a score of the log may suffer, a line each."""
    back = int((clock_steps(log) < 0).sum())
    clock = [f"the clock runs backwards {back} times; rows are taken in their order"] if back else []
    time_s = log["t_s"] if log.has("t_s") else np.empty(0)
    gaps = lost_samples(time_s, true_period(time_s) or SAMPLE_PERIOD_S)
    holes, lost = [g for g in gaps if g.seconds >= LONG_HOLE_S], sum(g.lost for g in gaps)
    if holes and not back:
        longest = max(holes, key=lambda g: g.seconds)
        clock.append(f"no sample in {longest.seconds:.2f} s before sample {longest.sample}; rows are taken as if there "
                     "were no hole")
    if lost > MOST_LOST * (len(log) + lost) and not back:
        clock.append(f"{lost} samples were lost beside {len(log)} logged ones; rows are taken as if none were")
    return [str(w) for w in log.meta.get("warnings", [])] + clock


def remarks_by_flight(noted: Iterable[tuple[FlightScore, list[str]]], scores: Sequence[FlightScore],
                      left_out: Sequence[tuple[str, str]]) -> dict[str, list[str]]:
    """Flight -> remarks, of flights that have any: by file name, by path where two flights share a name."""
    names = Counter([score.file for score in scores] + [Path(path).name for path, _ in left_out])
    return {score.file if names[score.file] == 1 else score.path: lines for score, lines in noted if lines}


def truth(log: FlightLog) -> list[logs.Edge] | None:
    """True edges by the `arm_pwm` of the log's vehicle, None where the log holds no down range."""
    if not log.has("zrange_m") or not np.isfinite(log["zrange_m"]).any():
        return None
    return logs.true_edges(log, arm_pwm=arm_pwm_of(log.meta))


def evaluate_flight(file: FlightFile, log: FlightLog, detector: Detector, model: Any) -> Result:
    """The detector's result on one flight; where it has several models, by the one that serves the log."""
    model = model_for(detector, model, log)
    return result_of(file, log, detector.run(log, model), detector, model)


def result_of(file: FlightFile, log: FlightLog, trace: Trace, detector: Detector, model: Any) -> Result:
    """The score of a trace that the detector gave with this model."""
    condition = with_flown_speed(file, log).condition
    score = score_flight(file.path.name, condition, truth(log),
                         sensors.airborne_by(log, arm_pwm_of(log.meta))[0], trace, detector.lag_s(model))
    note = "; ".join(text for text in (score.note, trace.note) if text)
    trained = training_set.contains(getattr(model, "metadata", {}), log)
    return Result(log, trace, replace(score, note=note, in_training=trained, path=str(file.path)))


def evaluate(
    files: Iterable[FlightFile],
    detector: Detector,
    model: Any,
    on_result: Callable[[Result | AirTouchError], None] = lambda _: None,
) -> tuple[list[FlightScore], list[tuple[str, str]]]:
    """(scores, flights left out with the reason). One flight is held in memory at a time.

    on_result gets each result, or the AirTouchError of a flight that cannot be used.
    """
    scores: list[FlightScore] = []
    left_out: list[tuple[str, str]] = []
    for file in files:
        try:
            log = read_flight(file, spare_of(detector), arm_pwm_by(detector, model))
            result = evaluate_flight(file, log, detector, model)
        except AirTouchError as error:
            left_out.append((str(file.path), str(error)))
            on_result(error)
            continue
        scores.append(result.score)
        on_result(result)
    return scores, left_out


def as_json(
    name: str,
    scores: Sequence[FlightScore],
    left_out: Sequence[tuple[str, str]],
    lag_s: float | list[float],
    parameters: dict[str, Any],
) -> dict[str, Any]:
    """The JSON of `airtouch evaluate`: plain numbers or null, intervals apart."""
    return {
        "detector": name,
        **summary.summarise(scores),
        "lag_s": lag_s,
        "parameters": parameters,
        "by_height": summary.by_height(scores),
        "by_angle": summary.by_angle(scores),
        "by_wind": summary.by_wind(scores),
        "in_training": [score.file for score in scores if score.in_training],
        "left_out": [{"file": file, "reason": reason} for file, reason in left_out],
        "per_flight": [score.as_dict() for score in scores],
    }
