"""More white noise on the IMU than declared."""

from airtouch.simulation.effects.effect import Effect, Parameter


def settings(plant, v):
    plant["acc_noise"] *= v["factor"]
    plant["gyro_noise"] *= v["factor"]


EFFECT = Effect(
    "imu_noise", "white noise of the IMU, as logged",
    (Parameter("factor", "1", 3.0, 0.0, 30.0, 1.0, "times the declared rms",
               "authors' flights: 0.05 to 0.07 m/s^2 per 10 Hz above 20 Hz"),),
    settings=settings)
