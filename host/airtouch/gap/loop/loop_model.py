"""Linear model of the attitude and height loops: what noise makes of the motor commands.

The controllers are those of `gap.loop.controller`. Commands are in newtons per motor.
"""

from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d

from airtouch.gap.flights.flight import PERIOD_S
from airtouch.gap.loop.controller import AXES, Controller, firmware

FOLDS = (0, 1, -1, 2, -2)  #: multiples of the log's rate that fall onto a frequency (500 Hz controller)
FLOW_HZ = 1.5  #: above it the estimated velocity's error falls by its square; errors of optical flow last 0.1 s
YAW_HZ = 1.0  #: usual bandwidth of a yaw loop, which AXES leave out
OUTER_S = 0.01  #: period of the firmware's position loop and of its estimator's predictions
IMU_S = 0.001  #: between samples of the IMU
KICKS = np.linspace(1.0, 0.0, 21)  #: shares that are tried of a step's first sample
STEP_HZ = (1.5, 14.0)  #: where they are fitted
UNCUT = 0.95  #: share of a kick from which the command's limits do not cut it
#: of the gains, with which what is left of a cut kick falls: so it does in ten pairs of simulated flights each with
CUT_POWER = 0.6  #: attitude gains of 0.5 to 1.5 and rate gains of 0.8 to 1.3
CROSSING_HZ = np.geomspace(0.3, 45.0, 160)  #: where a loop's gain may last be 1


#: what `loop_parts` gives
Parts = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def of_loop(row: Any, axis: str) -> tuple[float, ...]:
    """All that a plant row gives the loop of one axis beside its controller: rows alike in this have the same spectra.

    The controller itself, where it is the firmware's, is `firmware(row, axis)`.
    """
    lags = [float(row[name]) for name in ("actuator_delay", "motor_rise", "motor_fall", "sensor_delay")]
    gains = [_mean_of_rotors(row["gain"]), *(float(row[name]) for name in (
        "height_gain", "rate_gain", "attitude_gain", "position_gain", "gravity", "mass"))]
    if axis == "thrust":
        return (*lags, *gains)
    i = AXES.index(axis) - 1
    return (*lags, *gains[:-1], _arm(row, i), float(row["inertia"][i]))


def _arm(row: Any, i: int) -> float:
    """Mean distance of the rotors from the axis of roll (0) or pitch (1), m."""
    return _mean_of_rotors(np.abs(row["rotor_y" if i == 0 else "rotor_x"]))


def _mean_of_rotors(values: np.ndarray) -> float:
    """Mean (4,); NumPy's own takes ten times as long."""
    a, b, c, d = values.tolist()
    return (a + b + c + d) / 4.0


def spectra(c: Controller, row: Any, axis: str, f: np.ndarray) -> np.ndarray:
    """Power (sources, bins) of the command for noise of unit power at each source, aliases included.

    Sources, roll and pitch: white rate; with the firmware's controller velocity flat up to FLOW_HZ and falling with
    the frequency's square beyond, with another one white angle and velocity falling with the frequency; velocity and
    angle falling with its square; torque. Thrust: white climb, climb falling with the frequency, its square, force,
    white error of the down range, the same drifting from reading to reading.
    row: plant row of `simulation.flight.prepare`, effects in it.
    """
    return _with_aliases(_sources(c, row, axis, f), _aliases(c, row, axis, f))


def _aliases(c: Controller, row: Any, axis: str, f: np.ndarray) -> np.ndarray:
    """What of the first source's noise folds into the log, noise to command, complex (folds, bins)."""
    if axis == "thrust" or c.period_s >= 0.5 * PERIOD_S:
        return np.zeros((0, len(f)))
    folded = np.maximum(np.abs(f + np.array(FOLDS[1:])[:, None] / PERIOD_S), 0.05)
    fixed = _fixed(c, folded)
    plant, rate, angle, velocity, whole = loop_parts(c, row, axis, folded)
    kick = _kick(c, fixed)
    turned = plant * -(rate + angle) / (1.0 + plant * whole)
    return -(rate + kick * angle) - (rate + kick * (angle + velocity)) * turned


def _with_aliases(power: np.ndarray, aliases: np.ndarray) -> np.ndarray:
    for folded in aliases:
        power[0] += np.abs(folded) ** 2
    return power


def excess_phase(c: Controller, row: Any, axis: str) -> float:
    """Phase (rad) by which the loop lags more than half a turn where its gain last is 1; > 0: unstable."""
    loop = _open_loop(c, row, axis, CROSSING_HZ)
    turned, size = np.unwrap(np.angle(loop)), np.abs(loop)
    turned += -2.0 * np.pi * np.ceil(turned[0] / (2.0 * np.pi))
    last = np.flatnonzero(size > 1.0)
    return float(-np.pi - turned[last[-1]]) if len(last) else -np.pi


def sensitivity(controllers: Sequence[Controller], row: Any, f: np.ndarray) -> np.ndarray:
    """Share (bins, 3) of an outside roll, pitch, yaw torque that turns the vehicle in spite of the loop.

    controllers: of AXES. f: Hz (bins,).
    """
    f = np.maximum(f, 0.05)
    s = 2j * np.pi * f
    out = [1.0 / (1.0 + _open_loop(c, row, axis, f)) for c, axis in zip(controllers[1:], AXES[1:], strict=True)]
    return np.stack([*out, s / (s + 2.0 * np.pi * YAW_HZ)], axis=1)


class Step(NamedTuple):
    """Steps of a velocity set-point in a block.

    power: of the steps, over that of noise of unit strength; kick: share of the derivative at the first sample that is
    left by the limits of the command, which are 16 bits and what the motors take.
    """

    power: float = 0.0
    kick: float = 1.0


NO_STEP = Step()


def turning_per_command(c: Controller, row: Any, axis: str, strengths: np.ndarray, f: np.ndarray,
                        width: float = 0.0, step: Step = NO_STEP) -> np.ndarray:
    """Angular acceleration (..., bins) to be expected for a logged command, rad/s^2 per N: S_yu / S_uu of roll or pitch

    for noise of given strengths (..., sources) and steps; width: of neighbouring bins of f that are
    smoothed over, standard deviation.
    """
    return turnings_per_command(c, row, axis, strengths, f, width, [step])[0]


def turnings_per_command(c: Controller, row: Any, axis: str, strengths: np.ndarray, f: np.ndarray, width: float,
                         steps: Sequence[Step]) -> list[np.ndarray]:
    """`turning_per_command` for each of several steps."""
    at = np.maximum(f, 0.05)
    parts = loop_parts(c, row, axis, at)
    cross, power = (strengths @ x for x in _spectra_of_turning(c, row, axis, f, parts))
    made = {NO_STEP: (cross, power)}
    known = [s for s in dict.fromkeys(steps) if s.power]
    for s, stepped in zip(known, _stepped(c, row, at, parts, [s.kick for s in known]), strict=True):
        made[s] = _with_steps(cross, power, s.power, *stepped)
    crosses, powers = (np.array(x) for x in zip(*made.values(), strict=True))
    if width > 0.0:
        crosses, powers = (gaussian_filter1d(x, width, axis=-1, mode="nearest") for x in (crosses, powers))
    each = dict(zip(made, crosses / powers, strict=True))
    return [each[s if s.power else NO_STEP] for s in steps]


def _with_steps(cross: np.ndarray, power: np.ndarray, amount: float, logged: np.ndarray, turned: np.ndarray,
                ) -> tuple[np.ndarray, np.ndarray]:
    """S_yu and S_uu of noise, `cross` and `power`, and of steps of a power `amount` beside it (`_stepped`)."""
    return cross + amount * turned * logged.conj(), power + amount * np.abs(logged) ** 2


def _spectra_of_turning(c: Controller, row: Any, axis: str, f: np.ndarray, parts: Parts,
                        ) -> tuple[np.ndarray, np.ndarray]:
    """S_yu and S_uu (sources, bins) of the angular acceleration and the logged command for noise of unit power.

    parts: of the loop at f, no lower than 0.05 Hz.
    """
    logged, turned = _transfers(c, row, np.maximum(f, 0.05), parts)
    cross, aliases = turned * logged.conj(), _aliases(c, row, axis, f)
    for k, folded in zip(FOLDS[1:], aliases, strict=False):  # noise of the gyro folds into log and command alike
        beyond = f + k / PERIOD_S
        both = folded.conj() / _butterworth(2j * np.pi * np.abs(beyond), c.chip_hz)
        cross[0] += _difference(f) * np.where(beyond < 0.0, both.conj(), both)
    return cross, _with_aliases(np.abs(logged) ** 2, aliases)


def step_of(c: Controller, row: Any, axis: str, strengths: np.ndarray, f: np.ndarray, over: np.ndarray,
            turning: np.ndarray) -> Step:
    """The steps that explain blocks of nominal flights best, by least squares.

    strengths (sources,): of the noise; over (bins,): power of their commands over that of blocks without a step;
    turning (bins,): measured S_yu / S_uu, 0 where it is not known.
    """
    known = (turning != 0.0) & (f > STEP_HZ[0]) & (f < STEP_HZ[1])
    if not known.any():
        return NO_STEP
    at = np.maximum(f, 0.05)
    parts = loop_parts(c, row, axis, at)
    cross, noise = (strengths @ x for x in _spectra_of_turning(c, row, axis, f, parts))
    best, least = NO_STEP, np.inf
    for kick, (logged, turned) in zip(KICKS, _stepped(c, row, at, parts, KICKS), strict=True):
        step = Step(float(np.median(((over - 1.0) * noise / np.abs(logged) ** 2)[known])), float(kick))
        if step.power > 0.0:
            both, power = _with_steps(cross, noise, step.power, logged, turned)
            made = both / power
            misfit = float((np.abs(made[known] / turning[known] - 1.0) ** 2).sum())
            if misfit < least:
                best, least = step, misfit
    return best


def step_under(step: Step, c: Controller, before: Any, row: Any) -> Step:
    """Steps of the same set-point under another plant row; step: those under `before`.

    What the limits leave of the first sample of a large step has one size however high the gains; smaller steps are
    not cut: together it falls by CUT_POWER of the gains.
    """
    if step.kick >= UNCUT or not c.on_error:
        return step
    ahead = c.derivative / c.period_s
    gains = [float(r["rate_gain"]) * float(r["attitude_gain"]) * float(r["position_gain"]) for r in (before, row)]
    kick = ((1.0 + ahead * step.kick) * (gains[0] / gains[1]) ** CUT_POWER - 1.0) / ahead
    return step._replace(kick=float(np.clip(kick, 0.0, 1.0)))


def _difference(f: np.ndarray) -> np.ndarray:
    """Of two samples of the log over their distance in time, at the middle between them, 1/s."""
    return 2j * np.sin(np.pi * f * PERIOD_S) / PERIOD_S


def torque_per_command(row: Any, axis: str, f: np.ndarray, c: Controller | None = None) -> np.ndarray:
    """Angular acceleration (bins,) that the motors make of a command, rad/s^2 per N. c: the firmware's by default."""
    f = np.maximum(f, 0.05)
    return 2j * np.pi * f * _plant(firmware(row, axis) if c is None else c, row, axis, f)


def _plant(c: Controller, row: Any, axis: str, f: np.ndarray) -> np.ndarray:
    """Command to measured rate (climb), complex (bins,)."""
    fixed = _fixed(c, f)
    s = fixed.s
    motor = _delayed(float(row["actuator_delay"]), 0.0, f.shape, f.tobytes()) * fixed.hold * 0.5 * (
        1.0 / (1.0 + s * float(row["motor_rise"])) + 1.0 / (1.0 + s * float(row["motor_fall"])))
    lift = 4.0 * _mean_of_rotors(row["gain"])
    if axis == "thrust":
        return lift / float(row["mass"]) * motor / s
    i = AXES.index(axis) - 1
    return lift * _arm(row, i) / float(row["inertia"][i]) * motor / s


def loop_parts(c: Controller, row: Any, axis: str, f: np.ndarray) -> Parts:
    """Transfer functions at frequencies f, Hz, each complex and as long as f: plant, rate path, angle path, velocity
    path and the whole controller.

    A path is from the measured rate, through its integrals, to the command; on the height axis rate, angle and
    velocity are climb, height and its integral.
    """
    fixed = _fixed(c, f)
    s = fixed.s
    plant = _plant(c, row, axis, f)
    late = _delayed(float(row["sensor_delay"]), IMU_S if c.lowpass_hz or c.acc_hz else 0.0, f.shape, f.tobytes())
    renewed = fixed.renewed
    if axis == "thrust":
        k = float(row["height_gain"])
        late = late * renewed / fixed.acc
        climb = k * c.gain * fixed.integral * late
        height = climb * c.angle * k * fixed.angle_integral / s
        return plant, climb, height, 0.0 * s, climb + height
    k = c.gain * float(row["rate_gain"])
    filtered = late / fixed.lowpass / fixed.chip
    rate = k * fixed.whole * filtered
    angle = k * (fixed.whole if c.on_error else fixed.integral) * c.angle * float(row["attitude_gain"])
    angle = angle * fixed.angle_integral
    velocity = angle * c.velocity * float(row["position_gain"]) * fixed.velocity_integral
    angle, velocity = angle * filtered * renewed / s, velocity * renewed * float(row["gravity"]) / fixed.s2 * late
    return plant, rate, angle, velocity, rate + angle + velocity


class Fixed(NamedTuple):
    """What no gain and no vehicle changes in the loop at some frequencies: arrays of their shape, or 1.

    s: 2 pi i f; s2: its square; hold: of the motors' commands; renewed: of the estimator's attitude, velocity and
    height, which hold between two predictions; integral, angle_integral, velocity_integral: 1 and the integral of the
    error, in the three loops; whole: with the derivative, in the innermost; outer: differences over a run of the outer
    loop, 1/s; lowpass, chip, acc: by which the controller's low-pass, the gyro's own and that of the acceleration
    divide.
    """

    s: np.ndarray
    s2: np.ndarray
    hold: np.ndarray
    renewed: np.ndarray
    integral: np.ndarray
    angle_integral: np.ndarray
    velocity_integral: np.ndarray
    whole: np.ndarray
    outer: np.ndarray
    lowpass: np.ndarray | float
    chip: np.ndarray | float
    acc: np.ndarray | float


def _fixed(c: Controller, f: np.ndarray) -> Fixed:
    return _fixed_at(c.period_s, c.hold_s, (c.lowpass_hz, c.chip_hz, c.acc_hz),
                     (c.integral, c.angle_integral, c.velocity_integral, c.derivative), f.shape, f.tobytes())


@lru_cache(256)
def _fixed_at(period: float, hold: float, filters: tuple[float, float, float],
              shares: tuple[float, float, float, float], shape: tuple[int, ...], frequencies: bytes) -> Fixed:
    f = np.frombuffer(frequencies).reshape(shape)
    s = 2j * np.pi * f
    runs = round(hold / period) if filters[0] else 1
    held = sum(np.exp(-s * k * period) for k in range(runs)) / runs if runs > 1 else 1.0 + 0.0 * s
    lowpass, chip, acc = (_butterworth(s, cutoff) for cutoff in filters)
    integral, angle_integral, velocity_integral = (1.0 + share / s for share in shares[:3])
    return Fixed(s, s ** 2, np.sinc(f * period) * np.exp(-0.5 * s * period),
                 held * np.exp(-0.5 * s * IMU_S) if hold else held, integral, angle_integral, velocity_integral,
                 integral + shares[3] * ((1.0 - np.exp(-s * period)) / period), (1.0 - np.exp(-s * OUTER_S)) / period,
                 lowpass, chip, acc)


def _open_loop(c: Controller, row: Any, axis: str, f: np.ndarray) -> np.ndarray:
    plant, *_, whole = loop_parts(c, row, axis, f)
    return plant * whole


def _sources(c: Controller, row: Any, axis: str, f: np.ndarray) -> np.ndarray:
    """Power (sources, bins) of the logged command for noise of unit power, without aliases."""
    f = np.maximum(f, 0.05)
    if axis == "thrust":
        s, low = 2j * np.pi * f, np.maximum(f, 0.3)
        plant, climb, _, _, whole = loop_parts(c, row, axis, f)
        size = 1.0 / (1.0 + plant * whole)
        climbs = np.abs(whole * size) ** 2
        sources = [np.abs(climb * size) ** 2, climbs / low ** 2, climbs / low ** 4, np.abs(whole / s * size) ** 2]
        if c.range_gains[0]:
            sources += _range_errors(c, row, f, size)
        return np.array(sources)
    return np.abs(_transfers(c, row, f, loop_parts(c, row, axis, f))[0]) ** 2


def _transfers(c: Controller, row: Any, f: np.ndarray, parts: Parts) -> tuple[np.ndarray, np.ndarray]:
    """Of roll or pitch, (sources, bins) each: noise to logged command, noise to measured angular acceleration.

    parts: of the loop at f.
    """
    fixed, low = _fixed(c, f), np.maximum(f, 0.3)
    s = fixed.s
    plant, rate, angle, velocity, whole = parts
    size = 1.0 / (1.0 + plant * whole)
    kick = _kick(c, fixed)
    tilt, speed = _paths(c, row, fixed)
    wandering = [speed / (low ** 2 + FLOW_HZ ** 2)] if c.lowpass_hz else [tilt, speed / low]
    outer = [*wandering, speed / low ** 2, tilt / low ** 2]
    direct = np.array([-(rate + angle), *outer, 0.0 * s])
    stepped = np.array([-(rate + kick * angle), *(kick * np.array(outer)), 0.0 * s])
    turned = plant * direct * size  # rate
    turned[-1] = size / s
    logged = stepped - (rate + kick * (angle + velocity)) * turned
    turned = s * turned
    turned[0] += _difference(f) / fixed.chip
    return logged, turned


def _stepped(c: Controller, row: Any, f: np.ndarray, parts: Parts, passed: Iterable[float],
             ) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Of roll or pitch, (bins,) each: steps of the velocity's set-point to logged command and angular acceleration.

    parts: of the loop at f. passed: shares of the first sample's derivative that the command's limits leave, a pair
    for each; what follows is too small for them.
    """
    fixed = _fixed(c, f)
    plant, rate, angle, velocity, whole = parts
    step = _paths(c, row, fixed)[1] / np.maximum(f, 0.3)
    turned = plant * step / (1.0 + plant * whole)
    later, turning = (rate + _kick(c, fixed) * (angle + velocity)) * turned, fixed.s * turned
    for share in passed:
        yield _kick(c, fixed, share) * step - later, turning


def _paths(c: Controller, row: Any, fixed: Fixed) -> tuple[np.ndarray, np.ndarray]:
    """Command (bins,) for an angle and for a velocity of 1 that the controller is asked for."""
    k = c.gain * float(row["rate_gain"])
    tilt = k * fixed.integral * c.angle * float(row["attitude_gain"])
    if c.on_error:
        tilt = tilt * fixed.whole / fixed.integral
    speed = tilt * c.velocity * float(row["position_gain"]) * fixed.velocity_integral
    return tilt * fixed.angle_integral, speed


def _kick(c: Controller, fixed: Fixed, passed: float = 1.0) -> np.ndarray | float:
    """Angle path in the log over that in the loop: set-points of the outer loop and attitudes come as steps, and the

    log takes the sample on which they do. passed: share of that sample's derivative that the command's limits leave.
    """
    if not c.on_error:
        return 1.0
    return (fixed.integral + passed * c.derivative * fixed.outer) / fixed.whole


def _range_errors(c: Controller, row: Any, f: np.ndarray, size: np.ndarray) -> list[np.ndarray]:
    """Power (bins,) of the logged command for white errors of the down range, and for drifting ones; aliases in it.

    size: of the closed loop over the open one at f.
    """
    white, drifting = np.zeros(len(f)), np.zeros(len(f))
    for k in FOLDS:
        g = f + k / PERIOD_S
        power = np.abs(_ranged(c, row, g) * (1.0 if k else size)) ** 2
        white += power
        drifting += power / (4.0 * np.sin(np.pi * g * c.range_s) ** 2 + (0.6 * np.pi * c.range_s) ** 2)
    return [white, drifting]


def _ranged(c: Controller, row: Any, f: np.ndarray) -> np.ndarray:
    """Command for an error of the down range of 1 m at f (Hz), through the estimator's height and climb.

    Between two readings T apart the estimate moves on its own: X = (1 - (1 - K H) F / z)^-1 K.
    """
    s = 2j * np.pi * f
    height, climb = _estimated(*c.range_gains, c.range_s, f.tobytes())
    k = float(row["height_gain"])
    gain = k * c.gain * (1.0 + c.integral / s)
    return np.sinc(f * c.range_s) * gain * (climb + c.angle * k * (1.0 + c.angle_integral / s) * height)


@lru_cache(64)
def _estimated(a: float, b: float, t: float, frequencies: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Height and climb (1/s) of the estimator, gains a and b, for an error of readings t apart, complex (bins,)."""
    z = np.exp(-2j * np.pi * np.frombuffer(frequencies) * t)
    # (1 - K H) F = [[1 - a, (1 - a) t], [-b, 1 - b t]]
    m00, m01, m10, m11 = 1.0 - z * (1.0 - a), -z * (1.0 - a) * t, z * b, 1.0 - z * (1.0 - b * t)
    det = m00 * m11 - m01 * m10
    return (m11 * a - m01 * b) / det, (m00 * b - m10 * a) / det


@lru_cache(512)
def _delayed(delay: float, step: float, shape: tuple[int, ...], frequencies: bytes) -> np.ndarray:
    """A delay; between two steps the simulator (and this) draws a straight line, which smooths.

    Not below one step: there the smoothing alone would pass for lower gains.
    """
    s = 2j * np.pi * np.frombuffer(frequencies).reshape(shape)
    if step <= 0.0 or delay < step:
        return np.exp(-s * delay)
    whole = np.floor(delay / step + 1e-9)
    part = max(delay / step - whole, 0.0)
    return np.exp(-s * whole * step) * (1.0 - part + part * np.exp(-s * step))


def _butterworth(s: np.ndarray, cutoff: float) -> np.ndarray | float:
    """By what a second-order low-pass at the IMU's rate divides at s = 2 pi i f; 1 for a cutoff (Hz) that passes all.

    As in `simulation.filters`: bilinear, so that it takes more than its analogue towards half of that rate.
    """
    if cutoff <= 0.0 or cutoff >= 0.49 / IMU_S:
        return 1.0
    x = 1j * np.tan(0.5 * IMU_S * s.imag) / np.tan(np.pi * cutoff * IMU_S)
    return 1.0 + np.sqrt(2.0) * x + x * x
