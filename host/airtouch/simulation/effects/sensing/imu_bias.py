"""Constant error of accelerometer and gyro."""

from airtouch.simulation.effects.effect import Effect, Parameter


def settings(plant, v):
    plant["acc_bias"] += (v["acc_x"], v["acc_y"], v["acc_z"])
    plant["gyro_bias"] += (v["gyro_x"], v["gyro_y"], v["gyro_z"])


EFFECT = Effect(
    "imu_bias", "constant error of the IMU",
    tuple(Parameter(f"acc_{a}", "m/s^2", d, -5.0, 5.0, 0.0, f"accelerometer {a}", "BMI088: 20 mg zero offset")
          for a, d in zip("xyz", (0.15, 0.1, 0.1), strict=True))
    + tuple(Parameter(f"gyro_{a}", "rad/s", d, -1.0, 1.0, 0.0, f"gyro {a}", "BMI088: 1 deg/s zero offset")
            for a, d in zip("xyz", (0.02, -0.02, 0.02), strict=True)),
    settings=settings)
