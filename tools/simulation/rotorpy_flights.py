"""Makes labelled flights with RotorPy's Crazyflie and a control loop that is not the firmware's.

    python tools/simulation/rotorpy_flights.py OUT [--each 3] [--nominal 12] [--seed 0]    # 15 s of one core a flight
    python tools/diagnosis/gap_peers.py OUT

Body, motors and drag in a wind are RotorPy's (Folk et al. 2023, arXiv:2306.04485). Loop, log and the other effects
are added here: sensors, delays, gusts, ground effect (the formula of gym-pybullet-drones), battery, vibration.
Each flight takes off, hovers, passes over a platform, hovers and lands. OUT gets the flights and a manifest.csv of the
effect in each; existing flights are kept, so that a stopped run continues. Needs the extra `bench`.
"""

import argparse
import csv
import io
import os
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
import numpy as np

from airtouch.cli.shared.arguments import whole_number
from airtouch.cli.shared.progress import with_bar
from airtouch.errors import AirTouchError, in_one_line
from airtouch.logs import write
from airtouch.logs.files import write_bytes
from airtouch.logs.flight_log import FlightLog

STEP_S, ROWS = 0.002, 5  #: of the loop, and steps a row of the log: 100 Hz
MOTORS = (1, 2, 3, 0)  #: RotorPy's rotors front left, front right, rear right, rear left: the log's order
C0, C1, C2 = 5.484560e-4, 1.032633e-6, 2.130295e-11  #: thrust of PWM, N: c0 + c1 p + c2 p^2
LAG_S = 0.03
VEHICLE = f"""# RotorPy 3.0's Crazyflie, as declared
name = "rotorpy"
mass_kg = 0.030
arm_m = 0.043
inertia_kg_m2 = [1.43e-5, 1.43e-5, 2.89e-5]
thrust_of_pwm_n = [{C0}, {C1}, {C2}]
yaw_torque_over_thrust_m = 0.0339130
motor_time_constant_s = {LAG_S}
rotor_radius_m = 0.0235
rotor_drag_kg_per_rad = 0.0
acc_noise_rms_mps2 = 0.06
gyro_noise_rms_radps = 0.006
range_noise_rms_m = 0.002
gravity_mps2 = 9.81
"""
#: effect -> lowest and highest strength, unit; chosen: as those of the flights in FLIGHTS/peers
STRENGTHS = {
    "imu_noise": (3.0, 6.0, "x nominal"), "imu_bias": (0.8, 1.3, "x (0.25 m/s^2, 0.03 rad/s)"),
    "inertia": (0.25, 0.45, "fraction more"), "com_offset": (0.8, 1.6, "mm"), "latency": (5.0, 9.0, "ms"),
    "act_delay": (6.0, 10.0, "ms"), "motor_lag": (1.4, 1.8, "x nominal"), "wind": (0.4, 0.7, "m/s"),
    "gust": (0.4, 0.7, "m/s rms"), "rotor_drag": (2.5, 5.0, "x built-in"), "weak_motor": (0.07, 0.16, "thrust lost"),
    "thrust_coeff": (0.07, 0.14, "thrust lost"), "mass": (0.08, 0.16, "fraction more"),
    "battery_sag": (0.08, 0.15, "thrust lost at the end"), "vibration": (0.8, 2.0, "m/s^2"),
    "ground_effect": (0.6, 1.4, "x formula"), "time_jitter": (2.0, 4.0, "ms rms"),
}
BUILT_IN_DRAG = 10.2506e-7, 7.553e-07  #: RotorPy's k_d and k_z of its Crazyflie, kg/rad
#: correlation time of a gust, s, and its share along each axis: first-order noise, as Dryden's along the flow
GUST_S, GUST_SHARE = 1.0, np.array([1.0, 1.0, 0.5])
#: correlation time, s, and rms, m and m/s, of what the state estimate errs slowly, by position and velocity
DRIFT_S, DRIFT = np.array([[1.0], [0.3]]), np.array([[0.004], [0.02]])
COLUMNS = (*(f"acc_{a}_mps2" for a in "xyz"), *(f"gyro_{a}_radps" for a in "xyz"), *(f"m{i}_pwm" for i in (1, 2, 3, 4)),
           "zrange_m", *(f"v{a}_mps" for a in "xyz"), *(f"{a}_m" for a in "xyz"))


@dataclass(frozen=True)
class Label:
    """A flight of the manifest: its file, the effect in it with its strength, and the seed of all that is drawn."""

    file: str
    effect: str
    strength: float
    unit: str
    seed: int


def labels_of(each: int, nominal: int, seed: int) -> list[Label]:
    """The flights to make: two to calibrate on, so many with each effect, and so many without any."""
    rng = np.random.default_rng(seed)
    cases: list[tuple[str, float, str]] = [("none", 0.0, "")] * nominal
    cases += [(name, float(rng.uniform(low, high)), unit) for name, (low, high, unit) in STRENGTHS.items()
              for _ in range(each)]
    order = rng.permutation(len(cases))
    first = 1000 * seed
    return [*(Label(f"cal_A_{i}.csv.gz", "none", 0.0, "", first + 900 + i) for i in (0, 1)),
            *(Label(f"case_{k:03}.csv.gz", *cases[i], first + k) for k, i in enumerate(order))]


class Course:
    """A drawn mission: position (3,) and velocity (3,) that are wanted at a time, and the floor below a place."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.height, self.speed = rng.uniform(0.18, 0.4), 0.35
        self.top = self.height - rng.uniform(0.04, 0.12)
        self.begin, self.end = 0.8, rng.uniform(1.6, 2.0)
        self.rise_s, self.pass_s = 1.6, 6.5
        self.way = self.end + rng.uniform(0.4, 0.8)
        self.land_s = self.pass_s + self.way / self.speed + rng.uniform(2.5, 4.0)
        self.total_s = self.land_s + 2.0

    def at(self, t: float) -> tuple[np.ndarray, np.ndarray]:
        """Position and velocity wanted at t, s."""
        x = min(max(t - self.pass_s, 0.0) * self.speed, self.way)
        vx = self.speed if 0.0 < x < self.way else 0.0
        up = min(max(t - self.rise_s, 0.0) / 1.2, 1.0)
        down = min(max(t - self.land_s, 0.0) / 2.0, 1.0)
        return np.array([x, 0.0, self.height * min(up, 1.0 - down)]), np.array([vx, 0.0, 0.0])

    def floor(self, x: float) -> float:
        """Height of what lies below x, m."""
        return self.top if self.begin <= x <= self.end else 0.0


def thrust_of_pwm(pwm: np.ndarray) -> np.ndarray:
    """Thrust of each motor, N, at rest 0."""
    return np.where(pwm > 0, C0 + C1 * pwm + C2 * pwm * pwm, 0.0)


def pwm_of_thrust(thrust: np.ndarray) -> np.ndarray:
    """PWM, whole numbers from 0 to 65535."""
    root = np.sqrt(np.maximum(C1 * C1 - 4.0 * C2 * (C0 - np.maximum(thrust, C0)), 0.0))
    return np.clip(np.round((root - C1) / (2.0 * C2)), 0, 65535)


class Loop:
    """Cascade of P and PI controllers, from position to PWM, with gains of its own: not the firmware's."""

    def __init__(self, mass: float, inertia: Sequence[float], arm: float, yaw_arm: float) -> None:
        self.mass, self.inertia, self.arm, self.yaw_arm = mass, np.array(inertia), arm / np.sqrt(2.0), yaw_arm
        self.sum_v, self.sum_rate = np.zeros(3), np.zeros(3)

    def pwm(self, wanted: tuple[np.ndarray, np.ndarray], x: np.ndarray, v: np.ndarray, angles: np.ndarray,
            rate: np.ndarray) -> np.ndarray:
        """PWM (4,) in the log's order: m1 front right, m2 rear right, m3 rear left, m4 front left."""
        place, speed = wanted
        error = np.clip(2.0 * (place - x), -0.6, 0.6) + speed - v
        self.sum_v = np.clip(self.sum_v + error * STEP_S, -0.6, 0.6)
        acceleration = np.array([3.0, 3.0, 6.0]) * error + np.array([0.8, 0.8, 4.0]) * self.sum_v
        pitch, roll = (np.clip(a / 9.81, -0.35, 0.35) for a in (acceleration[0], -acceleration[1]))
        upright = max(np.cos(angles[0]) * np.cos(angles[1]), 0.6)
        thrust = self.mass * np.clip(9.81 + acceleration[2], 2.0, 16.0) / upright
        rate_error = 7.0 * (np.array([roll, pitch, 0.0]) - angles) - rate
        self.sum_rate = np.clip(self.sum_rate + rate_error * STEP_S, -0.5, 0.5)
        torque = self.inertia * (np.array([28.0, 28.0, 12.0]) * rate_error + 25.0 * self.sum_rate)
        r, p, y = torque[0] / self.arm, torque[1] / self.arm, torque[2] / self.yaw_arm
        return pwm_of_thrust(0.25 * (thrust + np.array([-r - p - y, -r + p + y, r + p - y, r - p + y])))


def fly(label: Label) -> FlightLog:
    """The log of a labelled flight. Raises AirTouchError where it falls."""
    from rotorpy.vehicles.crazyflie_params import quad_params
    from rotorpy.vehicles.multirotor import Multirotor
    from scipy.spatial.transform import Rotation

    class Craft(Multirotor):
        """RotorPy's vehicle with a factor (4,) on the thrust of each rotor."""

        factor = np.ones(4)

        def compute_body_wrench(self, body_rates, rotor_speeds, body_airspeed_vector):
            """Their wrench, at the rotor speeds that give such thrusts."""
            return super().compute_body_wrench(body_rates, rotor_speeds * np.sqrt(self.factor), body_airspeed_vector)

    rng = np.random.default_rng(label.seed)
    course = Course(rng)
    on = {name: label.strength if name == label.effect else 0.0 for name in STRENGTHS}
    p = {**quad_params, "tau_m": LAG_S, "k_d": 0.0, "k_z": 0.0}
    loop = Loop(p["mass"], (p["Ixx"], p["Iyy"], p["Izz"]), 0.043, p["k_m"] / p["k_eta"])
    p["mass"] *= 1.0 + on["mass"]
    for axis in ("Ixx", "Iyy", "Izz"):
        p[axis] *= 1.0 + on["inertia"]
    p["tau_m"] *= on["motor_lag"] or 1.0
    if drag := on["rotor_drag"] or float(bool(on["wind"] or on["gust"])):
        p["k_d"], p["k_z"] = (drag * k for k in BUILT_IN_DRAG)
    heading = rng.uniform(0.0, 2.0 * np.pi)
    across = np.array([np.cos(heading), np.sin(heading), 0.0])
    p["rotor_pos"] = {k: r - 0.001 * on["com_offset"] * across for k, r in p["rotor_pos"].items()}
    weak = np.ones(4)
    weak[rng.integers(4)] -= on["weak_motor"]
    weak -= on["thrust_coeff"]
    state = {"x": np.zeros(3), "v": np.zeros(3), "q": np.array([0.0, 0, 0, 1]), "w": np.zeros(3),
             "wind": on["wind"] * across, "rotor_speeds": np.zeros(4)}
    craft = Craft(p, state, integrator_kwargs={"method": "RK23", "rtol": 1e-4, "atol": 1e-7})
    noise = on["imu_noise"] or 1.0
    biases = [k * on["imu_bias"] * _direction(rng) for k in (0.25, 0.03)]
    late, old = (round(0.001 * on[k] / STEP_S) for k in ("act_delay", "latency"))
    commands, seen = [np.zeros(4)] * (late + 1), []
    turn, rows, resting, drift = rng.uniform(0.0, 2.0 * np.pi), [], True, np.zeros((2, 3))
    for step in range(round(course.total_s / STEP_S)):
        t = step * STEP_S
        rotation = Rotation.from_quat(state["q"])
        yaw, pitch, roll = rotation.as_euler("ZYX")
        turn += STEP_S * state["rotor_speeds"][0]
        tone = on["vibration"] * np.sin(turn) * (not resting)
        gyro = state["w"] + noise * rng.normal(0.0, 0.006, 3) + biases[1] + 0.05 * tone
        drift += -STEP_S / DRIFT_S * drift + np.sqrt(2.0 * STEP_S / DRIFT_S) * DRIFT * rng.standard_normal((2, 3))
        place = state["x"] + drift[0] + rng.normal(0.0, 0.001, 3)
        velocity = state["v"] + drift[1] + rng.normal(0.0, 0.006, 3)
        seen = [*seen, (place, velocity, np.array([roll, pitch, yaw]), gyro)][-old - 1:]
        flying = course.rise_s - 0.8 < t < course.land_s + 1.9
        pwm = loop.pwm(course.at(t), *seen[0]) if flying else np.zeros(4)
        commands = [*commands, pwm][-late - 1:]
        if step % ROWS == 0:
            change = craft.statedot(state, {"cmd_motor_speeds": state["rotor_speeds"]}, STEP_S)
            acc = rotation.inv().apply((0.0 if resting else change["vdot"]) + np.array([0.0, 0.0, 9.81]))
            floor = course.floor(state["x"][0])
            down = (state["x"][2] - floor) / max(np.cos(roll) * np.cos(pitch), 0.5)
            rows.append(np.r_[acc + noise * rng.normal(0.0, 0.06, 3) + biases[0] + tone, gyro, pwm,
                              np.round(down + 0.012 + rng.normal(0.0, 0.002), 3), velocity,
                              place + (0.0, 0.0, 0.012)])
        sag = on["battery_sag"] * (t / course.total_s)
        craft.factor = weak * (1.0 - sag) * (1.0 + _ground(on["ground_effect"], craft, state, rotation, course))
        if on["gust"]:
            pull = STEP_S / GUST_S
            state["wind"] = (1.0 - pull) * state["wind"] + np.sqrt(2.0 * pull) * on["gust"] * GUST_SHARE \
                * rng.standard_normal(3)
        speed = np.empty(4)
        speed[list(MOTORS)] = np.sqrt(thrust_of_pwm(commands[0]) / p["k_eta"])
        state = craft.step(state, {"cmd_motor_speeds": speed}, STEP_S)
        resting = state["x"][2] <= 0.0  # RotorPy's own ground holds a vehicle that climbs slower than 0.5 m/s
        if resting:
            state |= {"x": state["x"] * (1.0, 1.0, 0.0), "v": np.zeros(3), "w": np.zeros(3),
                      "q": Rotation.from_euler("Z", yaw).as_quat()}
        if not np.isfinite(state["x"]).all() or max(abs(roll), abs(pitch)) > 1.0:
            raise AirTouchError(f"{label.file}: falls at {t:.1f} s ({label.effect} {label.strength:.3g})")
    table = np.array(rows)
    time = 0.01 * np.arange(len(table))
    jitter = 0.001 * on["time_jitter"] * rng.standard_normal(len(time))
    return FlightLog({"t_s": np.maximum.accumulate(time + jitter - min(jitter[0], 0.0)),
                      **{name: table[:, i] for i, name in enumerate(COLUMNS)}})


def _direction(rng: np.random.Generator) -> np.ndarray:
    """A direction (3,) drawn evenly."""
    v = rng.standard_normal(3)
    return v / np.linalg.norm(v)


def _ground(strength: float, craft, state: dict, rotation, course: Course) -> np.ndarray:
    """Share (4,) of its thrust that each rotor gains by what lies below it: 11.37 (r / 4 h)^2, h 2 cm at least."""
    if not strength:
        return np.zeros(4)
    places = state["x"] + rotation.apply(craft.rotor_geometry)
    height = places[:, 2] + 0.02 - np.array([course.floor(x) for x in places[:, 0]])
    return strength * 11.37 * (0.0231348 / (4.0 * np.maximum(height, 0.02))) ** 2


def make(task: tuple[Path, Label]) -> str:
    """Make one flight where it is not there yet; what went wrong, or ""."""
    out, label = task
    if not (out / label.file).exists():
        try:
            write(fly(label), out / label.file)
        except AirTouchError as error:
            return str(error)
    return ""


def main() -> None:
    """Make the flights, then the manifest."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path, metavar="OUT")
    parser.add_argument("--each", type=whole_number(0), default=3, help="flights an effect (default %(default)s)")
    parser.add_argument("--nominal", type=whole_number(0), default=12, help="without an effect (default %(default)s)")
    parser.add_argument("--seed", type=whole_number(0), default=0)
    options = parser.parse_args()
    out: Path = options.out
    out.mkdir(parents=True, exist_ok=True)
    labels = labels_of(options.each, options.nominal, options.seed)
    write_bytes(VEHICLE.encode(), out / "vehicle_a.toml", force=True)
    with ProcessPoolExecutor() as pool:
        running = [pool.submit(make, (out, label)) for label in labels]
        for flight in with_bar(running, "flying"):
            if failed := flight.result():
                print(failed, file=sys.stderr)
    text = io.StringIO()
    table = csv.writer(text)
    table.writerow(("file", "vehicle", "effect", "strength", "unit"))
    table.writerows((x.file, "A", x.effect, f"{x.strength:.5g}", x.unit) for x in labels if (out / x.file).exists())
    write_bytes(text.getvalue().encode(), out / "manifest.csv", force=True)


if __name__ == "__main__":
    with in_one_line("rotorpy_flights"):
        main()
