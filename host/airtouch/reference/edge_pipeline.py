"""The whole pipeline, sample by sample in C, flight by flight here: features, force, threshold, edges."""

from dataclasses import dataclass
from math import isfinite

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.parameters import DEFAULT, Parameters
from airtouch.reference.band_power import band_bins, band_power, window_ends
from airtouch.reference.cross_spectrum import cascaded_cross_spectrum
from airtouch.reference.disturbance_force import disturbance_force, force_norm
from airtouch.reference.feature_window import deviation_from_mean
from airtouch.reference.finite import ACC_CLAMP, FLOAT32_MAX, PWM_MAX, RATE_CLAMP, hold_finite
from airtouch.reference.fr_cfar import fr_cfar
from airtouch.reference.shapes import repeated
from airtouch.vehicle import Vehicle

NONE, ENTRY, EXIT = 0, 1, 2  #: values of EdgeEvents.edge
NEVER = 1 << 30  #: samples since something that has not happened


@dataclass(frozen=True)
class EdgePipelineConfig:
    """What the pipeline may be told beyond the paper's parameters.

    cfar_input: "deviation", the squared deviation of f_w,z from its exponential
    mean in N^2, which an offset of the force (mass, battery, thrust curve) does
    not reach; or "norm", the paper's ||f_w|| in N as it is.
    physical_filter: whether edges without a recent alert are dropped.
    """

    parameters: Parameters = DEFAULT
    cfar_input: str = "deviation"
    physical_filter: bool = True

    def __post_init__(self) -> None:
        if self.cfar_input not in ("deviation", "norm"):
            raise AirTouchError(f"pipeline: cfar_input must be 'deviation' or 'norm', not {self.cfar_input!r}")


@dataclass(frozen=True)
class EdgeEvents:
    """One event a sample: what the C struct edgeEvent_t holds, as arrays.

    ready (n,) bool: features and band_power are new at this sample, else they hold the last ones.
    band_power (n, 9): (m/s^2)^2, (rad/s)^2, PWM^2; features (n, 3): their fusion; NaN before the first.
    force (n, 3) N; force_norm (n,) N; cfar_power (n,): the cell under test; threshold (n,).
    alert, alert_recent (n,) bool; edge (n,): NONE, ENTRY or EXIT; filtered (n,) bool: an edge was dropped.
    armed (n,) bool; non_finite (n,): values replaced so far, up to 10 a sample.
    """

    ready: np.ndarray
    band_power: np.ndarray
    features: np.ndarray
    force: np.ndarray
    force_norm: np.ndarray
    cfar_power: np.ndarray
    threshold: np.ndarray
    alert: np.ndarray
    alert_recent: np.ndarray
    edge: np.ndarray
    filtered: np.ndarray
    armed: np.ndarray
    non_finite: np.ndarray


def edge_pipeline(
    acc_world: np.ndarray,
    gyro: np.ndarray,
    pwm: np.ndarray,
    vehicle: Vehicle,
    *,
    vbat_v: np.ndarray | float | None = None,
    thrust_axis: np.ndarray | None = None,
    probability: np.ndarray | None = None,
    config: EdgePipelineConfig = EdgePipelineConfig(),
) -> EdgeEvents:
    """Band powers, fused features, disturbance force, FR-CFAR and edges of one flight.

    acc_world (n, 3) m/s^2 with gravity; gyro (n, 3) rad/s; pwm (n, 4); vbat_v (n,)
    or one value in V; thrust_axis (n, 3) or (3,); probability (n,), the network's
    latest P(over a platform), NaN for none. Missing voltage, axis and probability
    are not counted as non-finite samples.
    """
    p = config.parameters
    raw = np.column_stack(check_signals(acc_world, gyro, pwm))
    acc, rate = hold_finite(raw[:, :3], limit=ACC_CLAMP)[0], hold_finite(raw[:, 3:6], limit=RATE_CLAMP)[0]
    motors = np.clip(hold_finite(raw[:, 6:])[0], 0.0, PWM_MAX)
    n = len(raw)
    channels = np.column_stack([acc, rate, motors[:, 1:] - motors[:, :1]])
    ready, powers = _held_band_power(channels, p)
    force = disturbance_force(acc, motors, vehicle, vbat_v=vbat_v, thrust_axis=thrust_axis)
    power = cfar_input(force, config)
    threshold, alert = fr_cfar(power, guard_cells=p.guard_cells, leading_window=p.leading_window, p_fa=p.p_fa)
    alert_recent = _since(alert) < p.alert_hold
    armed = _airborne_for(motors, p) >= p.arm_samples
    crossing = decode(repeated(np.nan if probability is None else probability, (n,), "probability"), armed, p)
    dropped = (crossing != NONE) & ~alert_recent & config.physical_filter
    return EdgeEvents(
        ready=ready, band_power=powers, features=cascaded_cross_spectrum(powers),
        force=force, force_norm=force_norm(force), cfar_power=power, threshold=threshold,
        alert=alert, alert_recent=alert_recent, edge=np.where(dropped, NONE, crossing), filtered=dropped,
        armed=armed, non_finite=np.cumsum((~(np.abs(raw) <= FLOAT32_MAX)).sum(axis=1)),
    )


def cfar_input(force: np.ndarray, config: EdgePipelineConfig = EdgePipelineConfig()) -> np.ndarray:
    """The cells that FR-CFAR tests, (n,), from forces (n, 3); see EdgePipelineConfig.cfar_input."""
    if config.cfar_input == "norm":
        return force_norm(force)
    return np.square(deviation_from_mean(force[:, 2], config.parameters.force_mean_samples))


def decode(probability: np.ndarray, armed: np.ndarray, parameters: Parameters = DEFAULT) -> np.ndarray:
    """Edges (n,), NONE, ENTRY or EXIT, from probabilities (n,) by hysteresis, causal.

    Over the platform from `probability_entry` up until `probability_exit` down, with at least
    `dwell_samples` between two edges; while not armed the state is off the platform.
    """
    edge = np.full(len(probability), NONE)
    over, since = False, NEVER
    pairs = zip(np.asarray(probability, float).tolist(), np.asarray(armed).tolist(), strict=True)
    for i, (value, ready) in enumerate(pairs):
        if not ready:
            over, since = False, NEVER
            continue
        since = min(since + 1, NEVER)
        if not isfinite(value) or since < parameters.dwell_samples:
            continue
        if value <= parameters.probability_exit if over else value >= parameters.probability_entry:
            over, since = not over, 0
            edge[i] = ENTRY if over else EXIT
    return edge


def check_signals(acc: np.ndarray, gyro: np.ndarray, pwm: np.ndarray) -> tuple[np.ndarray, ...]:
    """The three as float64 arrays; AirTouchError when their shapes disagree."""
    signals = tuple(np.asarray(s, dtype=np.float64) for s in (acc, gyro, pwm))
    n = len(signals[0])
    if [s.shape for s in signals] != [(n, 3), (n, 3), (n, 4)]:
        raise AirTouchError("pipeline: needs (n, 3) accelerations, (n, 3) rates and (n, 4) PWM, not "
                            + ", ".join(str(s.shape) for s in signals))
    return signals


def _held_band_power(channels: np.ndarray, p: Parameters) -> tuple[np.ndarray, np.ndarray]:
    """ready (n,) and powers (n, 9), each row the last one computed."""
    n, band = len(channels), (p.band_low_hz, p.band_high_hz)
    band_bins(p.sample_rate_hz, p.band_window, band)
    ends = window_ends(n, p.band_window, p.band_hop)
    powers = band_power(channels, sample_rate_hz=p.sample_rate_hz, window=p.band_window, band_hz=band)
    ready = np.zeros(n, dtype=bool)
    ready[ends] = True
    last = np.maximum.accumulate(np.where(ready, np.arange(n), -1)) if n else np.zeros(0, dtype=int)
    return ready, np.where(last[:, None] >= 0, powers[np.maximum(last, 0)], np.nan)


def _since(event: np.ndarray) -> np.ndarray:
    """Samples since the last True, 0 at it, NEVER before any."""
    rows = np.arange(len(event))
    last = np.maximum.accumulate(np.where(event, rows, -NEVER)) if len(event) else rows
    return np.minimum(rows - last, NEVER)


def _airborne_for(motors: np.ndarray, p: Parameters) -> np.ndarray:
    """Samples, this one included, for which the mean PWM has been above arm_pwm without a break."""
    rows = np.arange(1, len(motors) + 1)
    grounded = np.where(motors.mean(axis=1) > p.arm_pwm, 0, rows)
    return rows - (np.maximum.accumulate(grounded) if len(rows) else rows)
