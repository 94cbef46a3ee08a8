"""RotorPy's Crazyflie with a thrust curve of PWM, its vehicle file, and the effects that belong to it."""

from typing import Any

import numpy as np
from rotorpy.vehicles.crazyflie_params import quad_params
from rotorpy.vehicles.multirotor import Multirotor

from airtouch import vehicle as vehicles

from .labels import Label

MASS_KG, INERTIA = quad_params["mass"], tuple(quad_params[f"I{a}{a}"] for a in "xyz")
ARM_M = float(np.linalg.norm(quad_params["rotor_pos"]["r1"]))
YAW_ARM_M = quad_params["k_m"] / quad_params["k_eta"]
GRAVITY = 9.81
LAG_S = 0.03  #: chosen; RotorPy's is 0.072
FLAPPING = 1e-8  #: of RotorPy's flapping moment at strength 1, N m per rad/s and m/s
C0, C1, C2 = 5.484560e-4, 1.032633e-6, 2.130295e-11  #: thrust of a motor, N: c0 + c1 p + c2 p^2 of PWM p; chosen
ACC_NOISE, GYRO_NOISE, RANGE_NOISE = 0.06, 0.006, 0.002  #: rms: m/s^2, rad/s, m
FILE = f"""# Body of RotorPy 3.0's Crazyflie; motor lag, thrust curve, rotor radius and noise chosen, no drag
name = "rotorpy"
mass_kg = {MASS_KG}
arm_m = {ARM_M:.6g}
inertia_kg_m2 = [{INERTIA[0]}, {INERTIA[1]}, {INERTIA[2]}]
thrust_of_pwm_n = [{C0}, {C1}, {C2}]
yaw_torque_over_thrust_m = {YAW_ARM_M:.6g}
motor_time_constant_s = {LAG_S}
rotor_radius_m = 0.0235
rotor_drag_kg_per_rad = 0.0
acc_noise_rms_mps2 = {ACC_NOISE}
gyro_noise_rms_radps = {GYRO_NOISE}
range_noise_rms_m = {RANGE_NOISE}
gravity_mps2 = {GRAVITY}
"""
DECLARED = vehicles.parse(FILE, "vehicle_a.toml")
ORDER = [1, 2, 3, 0]  #: RotorPy's rotors front left, front right, rear right, rear left in the log's order


class Craft(Multirotor):
    """RotorPy's vehicle, for each rotor a factor (4,) on its thrust, in RotorPy's order, and a push from above, N."""

    factor, push = np.ones(4), 0.0

    def compute_body_wrench(self, body_rates: np.ndarray, rotor_speeds: np.ndarray,
                            body_airspeed_vector: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """RotorPy's wrench at the rotor speeds that give such thrusts, and the push along the body's axis."""
        speeds = rotor_speeds * np.sqrt(self.factor)
        force, torque = super().compute_body_wrench(body_rates, speeds, body_airspeed_vector)
        return force - (0.0, 0.0, self.push), torque


def craft_of(label: Label, direction: np.ndarray) -> Craft:
    """The vehicle of a flight, at rest on the ground.

    direction (3,): horizontal unit vector, of the wind or of the centre of mass' offset. In a wind the vehicle has
    RotorPy's drag, else none but that of `rotor_drag`.
    """
    p: dict[str, Any] = {**quad_params, "tau_m": LAG_S * (label.of("motor_lag") or 1.0)}
    p["mass"] *= 1.0 + label.of("mass")
    for axis in "xyz":
        p[f"I{axis}{axis}"] *= 1.0 + label.of("inertia")
    in_wind = bool(label.of("wind") or label.of("gust"))
    drag = label.of("rotor_drag") or float(in_wind)  # none in the nominal vehicle
    p["k_d"], p["k_z"] = drag * p["k_d"], drag * p["k_z"]
    p["k_flap"] = FLAPPING * label.of("blade_flapping")
    p["rotor_pos"] = {k: r - 0.001 * label.of("com_offset") * direction for k, r in p["rotor_pos"].items()}
    state = {"x": np.zeros(3), "v": np.zeros(3), "q": np.array([0.0, 0.0, 0.0, 1.0]), "w": np.zeros(3),
             "wind": label.of("wind") * direction, "rotor_speeds": np.zeros(4)}
    return Craft(p, state, integrator_kwargs={"method": "RK23", "rtol": 1e-4, "atol": 1e-7})


def pwm_of_thrust(thrust: np.ndarray) -> np.ndarray:
    """PWM (4,), whole numbers from 0 to 65535, of thrusts, N: the inverse of `DECLARED.thrust`."""
    root = np.sqrt(np.maximum(C1 * C1 - 4.0 * C2 * (C0 - np.maximum(thrust, C0)), 0.0))
    return np.clip(np.round((root - C1) / (2.0 * C2)), 0, 65535)
