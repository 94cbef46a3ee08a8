"""One flight, step by step: what is seen, what is commanded, what the vehicle does, what is logged."""

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from airtouch.errors import AirTouchError
from airtouch.logs.flight_log import FlightLog

from .controller import Controller, Estimate
from .course import Course
from .labels import STEP_S, Label
from .vehicle import ACC_NOISE, DECLARED, GRAVITY, GYRO_NOISE, ORDER, RANGE_NOISE, Craft, craft_of

ROWS = 5  #: steps a row of the log: 100 Hz
#: correlation time, s, and rms, m and m/s, of what position and velocity err slowly; rms of what they err fast. Chosen
DRIFT_S, DRIFT, FAST = np.array([[1.0], [0.3]]), np.array([[0.004], [0.02]]), (0.001, 0.006)
#: correlation time of a gust, s, and its share along each axis: first-order noise, as Dryden's along the flow. Chosen
GUST_S, GUST_SHARE = 1.0, np.array([1.0, 1.0, 0.5])
BIAS = 0.25, 0.03  #: of the accelerometer, m/s^2, and the gyro, rad/s, at strength 1
GYRO_OVER_ACC = 0.05  #: of a vibration, rad/s over m/s^2; chosen, as in FLIGHTS/peers
STANDING_M, ROTORS_M = 0.012, 0.02  #: range at rest, and height of the rotors over the vehicle's lowest point
GROUND, RADIUS_M = 11.36859, 0.0231348  #: gym-pybullet-drones' ground effect: coefficient and rotor radius, m
LEAST_M = 0.25 * RADIUS_M * np.sqrt(15.0 * GROUND / 4.0)  #: its least height of a rotor, 3.8 cm
#: gym-pybullet-drones' wake of a vehicle that hovers so much higher, m, before the platform: its three coefficients
WAKE, HIGHER_M, WAKE_X_M = (2267.18, 0.16, -0.11), 1.0, (0.2, 0.6)
NOISE_S = 0.02  #: correlation time of motor noise, s; chosen
BURST = 2.0  #: rows lost in a row, mean; chosen
FALLEN_TILT_RAD = 1.0  #: beyond which a flight has failed
COLUMNS = (*(f"acc_{a}_mps2" for a in "xyz"), *(f"gyro_{a}_radps" for a in "xyz"), *(f"m{i}_pwm" for i in (1, 2, 3, 4)),
           "zrange_m", *(f"v{a}_mps" for a in "xyz"), *(f"{a}_m" for a in "xyz"))
State = dict[str, np.ndarray]  #: RotorPy's: x, v, q (w last), w, wind, rotor_speeds


class Sensors:
    """IMU, range, position and velocity with their errors; the attitude is known exactly.

    tone: vibration at the speed of one rotor, m/s^2, the same on each axis.
    """

    def __init__(self, label: Label, slow_error: float, rng: np.random.Generator) -> None:
        self.slow_rms = slow_error * DRIFT
        self.rng, self.noise, self.amplitude = rng, label.of("imu_noise") or 1.0, label.of("vibration")
        self.biases = [k * label.of("imu_bias") * _direction(rng) for k in BIAS]
        self.turned_rad, self.tone, self.drift = rng.uniform(0.0, 2.0 * np.pi), 0.0, np.zeros((2, 3))

    def estimate(self, state: State, angles: np.ndarray, resting: bool) -> Estimate:
        """The estimate of a state, a step after the last."""
        rng, fade = self.rng, STEP_S / DRIFT_S
        self.turned_rad += STEP_S * state["rotor_speeds"][0]
        self.tone = 0.0 if resting else self.amplitude * float(np.sin(self.turned_rad))
        rates = state["w"] + self.noise * rng.normal(0.0, GYRO_NOISE, 3) + self.biases[1] + GYRO_OVER_ACC * self.tone
        self.drift += np.sqrt(2.0 * fade) * self.slow_rms * rng.standard_normal((2, 3)) - fade * self.drift
        position, velocity = (state[k] + slow + rng.normal(0.0, fast, 3)
                              for k, slow, fast in zip("xv", self.drift, FAST, strict=True))
        return Estimate(position, velocity, angles, rates)

    def row(self, specific_force: np.ndarray, range_m: float, estimate: Estimate, pwm: np.ndarray) -> np.ndarray:
        """A row of the log, in the order of COLUMNS."""
        acc = specific_force + self.noise * self.rng.normal(0.0, ACC_NOISE, 3) + self.biases[0] + self.tone
        measured_m = np.round(range_m + STANDING_M + self.rng.normal(0.0, RANGE_NOISE), 3)
        position = estimate.position + (0.0, 0.0, STANDING_M)
        return np.r_[acc, estimate.rates, pwm, measured_m, estimate.velocity, position]


def fly(label: Label, slow_error: float = 1.0) -> FlightLog:
    """The log of a flight; slow_error: factor on DRIFT. Raises AirTouchError where the vehicle falls."""
    rng = np.random.default_rng(label.seed)
    course, controller = Course(rng), Controller(label.of("controller_gain") or 1.0)
    heading = rng.uniform(0.0, 2.0 * np.pi)
    craft = craft_of(label, np.array([np.cos(heading), np.sin(heading), 0.0]))
    rotor_factors = np.full(4, 1.0 - label.of("thrust_coeff"))
    rotor_factors[rng.integers(4)] -= label.of("weak_motor")
    rng_of_others = np.random.default_rng([label.seed, 1])  # OTHERS came later: flights without them stay as they were
    wake_x_m, motor_noise = rng_of_others.uniform(*WAKE_X_M), np.zeros(4)
    sensors, state = Sensors(label, slow_error, rng), craft.initial_state
    delay, latency = (round(0.001 * label.of(k) / STEP_S) for k in ("act_delay", "latency"))  # steps
    commands, estimates, rows, resting = [np.zeros(4)] * (delay + 1), [], [], True
    for step in range(round(course.total_s / STEP_S)):
        t, rotation = step * STEP_S, Rotation.from_quat(state["q"])
        yaw, pitch, roll = rotation.as_euler("ZYX")
        estimates = [*estimates, sensors.estimate(state, np.array([roll, pitch, yaw]), resting)][-latency - 1:]
        pwm = controller.pwm(course.at(t), estimates[0]) if course.motors_run(t) else np.zeros(4)
        commands = [*commands, pwm][-delay - 1:]
        if step % ROWS == 0:
            down_m = (state["x"][2] - course.surface(state["x"][0])) / max(np.cos(roll) * np.cos(pitch), 0.5)
            rows.append(sensors.row(_specific_force(craft, state, rotation, resting), down_m, estimates[-1], pwm))
        sag = label.of("battery_sag") * t / course.total_s
        craft.factor = rotor_factors * (1.0 - sag)
        if strength := label.of("ground_effect"):
            craft.factor *= 1.0 + strength * _lift(craft, state, rotation, course)
        if rms := label.of("motor_noise"):
            motor_noise = _first_order(motor_noise, NOISE_S, rms, rng_of_others)
            craft.factor *= np.maximum(1.0 + motor_noise, 0.0)
        craft.push = label.of("downwash") * _wake(state["x"] - (wake_x_m, 0.0, 0.0))
        if gust := label.of("gust"):
            state["wind"] = _first_order(state["wind"], GUST_S, gust * GUST_SHARE, rng)
        state = craft.step(state, {"cmd_motor_speeds": _speeds(craft, commands[0])}, STEP_S)
        resting = state["x"][2] <= 0.0  # RotorPy's own ground holds a vehicle that climbs slower than 0.5 m/s
        if resting:
            state |= {"x": state["x"] * (1.0, 1.0, 0.0), "v": np.zeros(3), "w": np.zeros(3),
                      "q": Rotation.from_euler("Z", yaw).as_quat()}
        if not max(abs(roll), abs(pitch)) < FALLEN_TILT_RAD:
            raise AirTouchError(f"{label.file}: falls at {t:.1f} s ({label.effect} {label.strength:.3g})")
    return _log(np.array(rows), label, rng, rng_of_others)


def _first_order(values: np.ndarray, time_s: float, rms: np.ndarray | float, rng: np.random.Generator) -> np.ndarray:
    """First-order noise (k,) of an rms, one for all or (k,), and a correlation time, a step after `values`."""
    fade = STEP_S / time_s
    return (1.0 - fade) * values + np.sqrt(2.0 * fade) * rms * rng.standard_normal(len(values))


def _log(table: np.ndarray, label: Label, rng: np.random.Generator, rng_of_losses: np.random.Generator) -> FlightLog:
    """The log of a table (rows, columns), with the times as they were logged and without the rows that were lost."""
    late = 0.001 * label.of("time_jitter") * rng.standard_normal(len(table))
    times = np.maximum.accumulate(ROWS * STEP_S * np.arange(len(table)) + late - min(late[0], 0.0))
    logged = ~_lost_rows(len(table), label.of("packet_loss"), rng_of_losses)
    return FlightLog({"t_s": times[logged], **{name: table[logged, i] for i, name in enumerate(COLUMNS)}})


def _lost_rows(n: int, share: float, rng: np.random.Generator) -> np.ndarray:
    """Which of n rows are lost, bool (n,): a share of them, in bursts of BURST rows in the mean."""
    begin, lost = share / (1.0 - share) / BURST, [False]
    for u in rng.random(n - 1):
        lost.append(bool(u > 1.0 / BURST) if lost[-1] else bool(u < begin))
    return np.array(lost)


def _wake(place: np.ndarray) -> float:
    """Push, N, of the wake of a vehicle that hovers HIGHER_M above a hover at the origin; place (3,): m."""
    strength, wider, width = WAKE
    peak = strength * (RADIUS_M / (4.0 * HIGHER_M)) ** 2
    return float(peak * np.exp(-0.5 * (np.hypot(*place[:2]) / (wider * HIGHER_M + width)) ** 2))


def _speeds(craft: Craft, pwm: np.ndarray) -> np.ndarray:
    """Speeds (4,), rad/s, in RotorPy's order, that a motor goes to at a PWM (4,)."""
    speeds = np.empty(4)
    speeds[ORDER] = np.sqrt(DECLARED.thrust(pwm) / craft.k_eta)
    return speeds


def _specific_force(craft: Craft, state: State, rotation: Any, resting: bool) -> np.ndarray:
    """What an accelerometer reads (3,), m/s^2, in the body's axes."""
    change = craft.statedot(state, {"cmd_motor_speeds": state["rotor_speeds"]}, STEP_S)["vdot"]
    return rotation.inv().apply((0.0 if resting else change) + np.array([0.0, 0.0, GRAVITY]))


def _lift(craft: Craft, state: State, rotation: Any, course: Course) -> np.ndarray:
    """Share (4,) of its thrust that each rotor gains by what lies below its disc, in RotorPy's order."""
    places = state["x"] + rotation.apply(craft.rotor_geometry)
    floor, platform = (GROUND * (RADIUS_M / (4.0 * np.maximum(places[:, 2] + ROTORS_M - top_m, LEAST_M))) ** 2
                       for top_m in (0.0, course.top_m))
    return floor + course.over_platform(places[:, 0], RADIUS_M) * (platform - floor)


def _direction(rng: np.random.Generator) -> np.ndarray:
    """A direction (3,) drawn evenly."""
    v = rng.standard_normal(3)
    return v / np.linalg.norm(v)
