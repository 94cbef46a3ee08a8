"""One row of the simulator's log: where each column stands, and how it is filled."""

from airtouch.simulation.body.rotation import euler
from airtouch.simulation.compiled import jit

RPM_OF_RADPS = 9.549296585513721  #: 30 / pi
(T, ACC, GYRO, PWM, DOWN, WALLS, VBAT, POSITION, VELOCITY, ANGLES, RPM, ACC_WORLD, COLUMNS) = (
    0, 1, 4, 7, 11, 12, 16, 17, 20, 23, 26, 30, 33)  #: first place of each; COLUMNS: length of a row


@jit
def write(plant, state, volts, out):
    """The log's stage: fill a row (33,) with the columns of the flight log, in its order and units.

    Sensors as measured; position (of the down range sensor), velocity and attitude true; acceleration in world axes
    as the firmware turns it. volts: what the motors see.
    """
    pose, r = state.body.state, state.firmware.kalman.r
    acc, gyro = state.imu.acc, state.imu.gyro
    out[T] = state.time_s
    out[ANGLES], out[ANGLES + 1], out[ANGLES + 2] = euler(pose[6:10])
    for i in range(3):
        out[ACC + i], out[GYRO + i] = acc[i], gyro[i]
        out[POSITION + i], out[VELOCITY + i] = pose[i], pose[3 + i]
        out[ACC_WORLD + i] = r[i, 0] * acc[0] + r[i, 1] * acc[1] + r[i, 2] * acc[2]
    out[POSITION + 2] -= plant.range_below_rotors
    for i in range(4):
        out[PWM + i], out[WALLS + i] = state.motors.pwm[i], state.walls[i]
        out[RPM + i] = state.body.rotor_speed[i] * RPM_OF_RADPS
    out[DOWN], out[VBAT] = state.ranging.down, volts
