"""Lines of the rotors' turns on the IMU, folded into the log's band."""

from airtouch.simulation.effects.effect import Effect, Parameter


def settings(plant, v):
    plant["vibration"] = v["amplitude"]
    plant["vibration_gyro"] = v["gyro"]


EFFECT = Effect(
    "vibration", "the rotors' 1/rev lines on the IMU, folded by the log rate",
    (Parameter("amplitude", "m/s^2", 1.0, 0.0, 30.0, 0.0,
               "amplitude of the accelerometer's line in hover, four rotors together",
               "out-of-balance propellers; none clear below 50 Hz in the authors' flights"),
     Parameter("gyro", "rad/m", 0.05, 0.0, 1.0, None,
               "gyro amplitude (rad/s) over the accelerometer's (m/s^2)")),
    settings=settings, once=True)
