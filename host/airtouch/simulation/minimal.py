"""A minimal flight generator: enough to try the pipeline without a recorded flight.

Rigid body with four rotors, attitude and height loops, the ground effect of
whatever is below each rotor, noise, battery sag. All flights of a batch are
computed side by side. Axes: x forward, y left, z up.
"""

from dataclasses import dataclass

import numpy as np

from airtouch import vehicle as vehicles
from airtouch.logs.flight_log import (
    ACC,
    ACC_WORLD,
    ATTITUDE,
    GYRO,
    POSITION,
    PWM,
    VELOCITY,
    FlightLog,
)

STEP_S = 0.002  #: physics and attitude loop, 500 Hz
SAMPLE_STEPS = 5  #: physics steps a logged sample, 100 Hz
CRUISE_M = 0.8  #: height over the floor
PLATFORM_M = 0.75  #: length of the platform along the path
RANGE_STEPS = 12  #: physics steps a range reading, 24 ms
TURBULENCE = 1.0  #: moment noise over a surface: rms, share of the ground effect's own moment
SIGNS_X = np.array([1.0, -1.0, -1.0, 1.0])  #: motors front right, rear right, rear left, front left
SIGNS_Y = np.array([-1.0, -1.0, 1.0, 1.0])
SIGNS_YAW = np.array([-1.0, 1.0, -1.0, 1.0])


@dataclass(frozen=True)
class Mission:
    """One sweep: take-off, hover, a straight line over a platform, hover, landing."""

    speed_mps: float = 0.25
    clearance_m: float = 0.04
    angle_deg: float = 0.0
    before_m: float = 2.0


def sanchez_cuevas(height_m: np.ndarray, radius_m: float, spacing_m: float) -> np.ndarray:
    """Thrust near a surface over thrust far from it for a quadrotor, any shape.

    height_m: rotor plane over the surface, clipped to 0.75 radii and above. spacing_m: between
    neighbouring rotors. Source: Sanchez-Cuevas, Heredia, Ollero, Characterization of the
    Aerodynamic Ground Effect and Its Influence in Multirotor Control, 2017, eq. 8 with K_b = 2.
    """
    z = np.maximum(height_m, 0.75 * radius_m)
    r2, d2 = radius_m**2, spacing_m**2
    loss = (
        (radius_m / (4 * z)) ** 2
        + r2 * z / (d2 + 4 * z**2) ** 1.5
        + 0.5 * r2 * z / (2 * d2 + 4 * z**2) ** 1.5
        + 2 * 2 * r2 * z / (2 * d2 + 4 * z**2) ** 1.5
    )
    return 1.0 / (1.0 - loss)


def missions(count: int, seed: int = 0) -> list[Mission]:
    """`count` sweeps at 0.2 to 0.35 m/s, 3 to 8 cm over the platform, at angles up to 20 degrees."""
    rng = np.random.default_rng(seed)
    return [
        Mission(float(rng.choice([0.2, 0.3, 0.35])), float(rng.uniform(0.03, 0.08)),
                float(rng.choice([-20.0, -10.0, 0.0, 10.0, 20.0])), float(rng.uniform(1.0, 3.0)))
        for _ in range(count)
    ]


def fly(plan: list[Mission], seed: int = 0, vehicle: vehicles.Vehicle | None = None) -> list[FlightLog]:
    """One log a mission at 100 Hz, with the true state and range; about 4 s for any small batch.

    Deterministic per seed: flight i depends on (seed, i) and its mission only.
    """
    v = vehicle or vehicles.load()
    n = len(plan)
    generators = [np.random.default_rng([seed, i]) for i in range(n)]

    def column(name: str) -> np.ndarray:
        return np.array([getattr(m, name) for m in plan])

    speed, clearance, angle = column("speed_mps"), column("clearance_m"), np.deg2rad(column("angle_deg"))
    platform_top = CRUISE_M - clearance
    before_edge, cosine, sine = column("before_m")[:, None], np.cos(angle)[:, None], np.sin(angle)[:, None]
    path = column("before_m") + PLATFORM_M / np.cos(angle) + 1.0
    sweep_s = path / speed
    end_s = 6.0 + sweep_s + 5.0
    samples = int(np.ceil(end_s.max() * 100))
    steps = samples * SAMPLE_STEPS
    white = np.stack([g.standard_normal((steps, 5)) for g in generators], axis=1)  # moments, force, height
    sensor = np.stack([g.standard_normal((samples, 7)) for g in generators], axis=1)
    gain = np.stack([g.normal(1.0, 0.02, 4) for g in generators])  # no two motors are alike
    bias = np.stack([np.r_[g.normal(0, 0.05, 3), g.normal(0, 0.01, 3)] for g in generators])
    volts_full = np.array([g.uniform(3.9, 4.1) for g in generators])

    arm, r = v.arm_m / np.sqrt(2), v.rotor_radius_m
    inertia, m, g0 = np.array(v.inertia_kg_m2), v.mass_kg, v.gravity_mps2
    hover_n = m * g0 / 4
    position, velocity = np.zeros((n, 3)), np.zeros((n, 3))
    attitude, rates, before = np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((n, 3))
    thrust, sum_z, sum_attitude = np.zeros((n, 4)), np.zeros(n), np.zeros((n, 3))
    gust, lifted, range_m = np.zeros((n, 4)), np.zeros(n, bool), np.zeros(n)
    volts = volts_full.copy()
    out = np.full((samples, n, 26), np.nan)
    pwm = np.zeros((n, 4))
    c0, c1, c2 = v.thrust_of_pwm_n

    for k in range(steps):
        t = k * STEP_S
        # reference: up in 2 s, hover until 6 s, sweep, hover 2 s, down in 2 s
        along = np.clip((t - 6.0) * speed, 0.0, path)
        moving = (along > 0) & (along < path)
        land = np.clip((t - 8.0 - sweep_s) / 2.0, 0.0, 1.0)
        goal_z = CRUISE_M * min(max(t - 0.5, 0.0) / 2.0, 1.0) * (1.0 - land)
        motors_on = (t > 0.5) & (land < 1.0)

        if k % SAMPLE_STEPS == 0:  # height and position, 100 Hz
            error_z = goal_z - position[:, 2] - 0.002 * white[k, :, 4]
            sum_z = np.clip(sum_z + error_z * 0.01, -1.0, 1.0) * motors_on
            lift = m * (g0 + 12.0 * error_z + 3.0 * sum_z - 5.0 * velocity[:, 2])
            want_x = 3.0 * (along - position[:, 0]) + 3.5 * (speed * moving - velocity[:, 0])
            want_y = -3.0 * position[:, 1] - 3.5 * velocity[:, 1]
            goal = np.clip(np.stack([-want_y, want_x, np.zeros(n)], axis=1) / g0, -0.3, 0.3)
        error = goal - attitude
        sum_attitude = np.clip(sum_attitude + error * STEP_S, -0.5, 0.5) * motors_on[:, None]
        turning = (rates - before) / STEP_S
        turn = inertia * (300.0 * error + 60.0 * sum_attitude - 30.0 * rates - 1.5 * turning)
        before = rates
        share = turn / (4.0 * np.array([arm, arm, v.yaw_torque_over_thrust_m]))
        wanted = (lift / 4)[:, None] + share[:, :1] * SIGNS_Y - share[:, 1:2] * SIGNS_X
        wanted = wanted + share[:, 2:] * SIGNS_YAW
        wanted = np.clip(wanted, c0, 2.2 * hover_n) * motors_on[:, None]
        root = np.sqrt(c1 * c1 + 4 * c2 * np.maximum(wanted - c0, 0))
        pwm = np.clip(np.round(np.where(wanted > 0, (root - c1) / (2 * c2), 0.0)), 0, 65535)
        volts += STEP_S * (-0.004 * motors_on)
        made = np.where(pwm > 0, (c0 + c1 * pwm + c2 * pwm * pwm) * gain * (volts / 4.0)[:, None] ** 2, 0.0)
        thrust = thrust + STEP_S / v.motor_time_constant_s * (made - thrust)

        # what is below each rotor: the platform is crossed along x, its edges turned by the angle
        rotor_x = position[:, :1] + arm * SIGNS_X
        rotor_y = position[:, 1:2] + arm * SIGNS_Y
        depth = (rotor_x - before_edge) * cosine + rotor_y * sine
        covered = np.clip((depth + r) / (2 * r), 0, 1) - np.clip((depth - PLATFORM_M + r) / (2 * r), 0, 1)
        rotor_z = position[:, 2:] + arm * (attitude[:, :1] * SIGNS_Y - attitude[:, 1:2] * SIGNS_X)
        over = sanchez_cuevas(rotor_z - platform_top[:, None], r, 2 * arm)
        floor = sanchez_cuevas(rotor_z + 0.01, r, 2 * arm)
        ratio = floor + covered * (over - floor)
        force = thrust * ratio
        gust = gust + STEP_S / 0.02 * (white[k, :, :4] * 3.2 - gust)
        strength = (TURBULENCE * hover_n * (ratio - 1.0).mean(axis=1) + 1e-3)[:, None] * motors_on[:, None]

        torque = np.stack([arm * (force * SIGNS_Y).sum(1), -arm * (force * SIGNS_X).sum(1),
                           v.yaw_torque_over_thrust_m * (force * SIGNS_YAW).sum(1)], axis=1)
        torque += gust[:, :3] * strength * arm * np.array([1.0, 1.0, 0.2])
        sin, cos = np.sin(attitude[:, :2]), np.cos(attitude[:, :2])
        up = np.stack([sin[:, 1], -sin[:, 0] * cos[:, 1], cos[:, 0] * cos[:, 1]], axis=1)
        total = force.sum(1) + gust[:, 3] * strength[:, 0]
        push = up * total[:, None] - 0.01 * velocity
        lifted = (lifted | (push[:, 2] > m * g0)) & motors_on | (position[:, 2] > 0.002)
        specific = np.where(lifted[:, None], push / m, np.array([0.0, 0.0, g0]))
        acceleration = np.where(lifted[:, None], specific - np.array([0.0, 0.0, g0]), 0.0)

        if k % RANGE_STEPS == 0:
            centre = (position[:, 0] - before_edge[:, 0]) * cosine[:, 0] + position[:, 1] * sine[:, 0]
            inside = (centre >= 0) & (centre < PLATFORM_M)
            range_m = np.maximum(position[:, 2] - inside * platform_top, 0.0)
        if k % SAMPLE_STEPS == 0:
            s = sensor[k // SAMPLE_STEPS]
            noisy = s[:, :3] * v.acc_noise_rms_mps2 + bias[:, :3]
            world = specific + noisy
            roll, pitch, (wx, wy, wz) = attitude[:, 0], attitude[:, 1], world.T
            body = np.stack([wx - pitch * wz, wy + roll * wz, wz + pitch * wx - roll * wy], axis=1)
            gyro = rates + s[:, 3:6] * v.gyro_noise_rms_radps + bias[:, 3:]
            seen = np.maximum(range_m + s[:, 6] * v.range_noise_rms_m, 0.0)
            out[k // SAMPLE_STEPS] = np.concatenate(
                [np.full((n, 1), t), body, gyro, pwm, seen[:, None], volts[:, None], position, velocity,
                 attitude, world, end_s[:, None]], axis=1)

        rates = rates + STEP_S * (torque - np.cross(rates, inertia * rates)) / inertia * lifted[:, None]
        rates = rates * lifted[:, None]
        attitude = (attitude + STEP_S * rates) * lifted[:, None]
        velocity = (velocity + STEP_S * acceleration) * lifted[:, None]
        position = position + STEP_S * velocity
        landed = position[:, 2] < 0.0
        position[landed, 2], velocity[landed] = 0.0, 0.0
    return [_log(out[:, i], plan[i], seed, i) for i in range(n)]


def _log(table: np.ndarray, mission: Mission, seed: int, index: int) -> FlightLog:
    """One flight of the batch, cut to its own length."""
    names = ("t_s", *ACC, *GYRO, *PWM, "zrange_m", "vbat_V", *POSITION, *VELOCITY, *ATTITUDE, *ACC_WORLD)
    rows = table[: int(table[0, -1] * 100)]
    meta = {"source": f"generated_{seed}_{index:03d}", "format": "generated", "sample_period_s": 0.01,
            "acc_frame": "body", "vehicle": "crazyflie-2.1-flow", "warnings": [], "condition": vars(mission)}
    return FlightLog({name: rows[:, i] for i, name in enumerate(names)}, meta)
