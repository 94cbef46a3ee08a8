"""One row of set-points (100 Hz) of the simulator, and what the firmware's controller makes of its modes."""

import math

from numba import float64

from airtouch.simulation.compiled import jit
from airtouch.simulation.firmware import controller

MODE, X, Y, Z, VX, VY, YAW, MOTORS, SETPOINT_SIZE = range(9)  #: places in a row
ROW = float64[::1]  #: a row (8,) in compiled code
FLY, HOLD, TILT, TILT_THRUST = 0.0, 1.0, 2.0, 3.0  #: values of MODE, see to_firmware


@jit
def to_firmware(row, out):
    """A row (8,) as the firmware's set-point (a firmware.controller.SETPOINT record).

    MODE HOLD: hold x, y; FLY: fly vx, vy (world axes), both at height z and heading yaw (rad); TILT: vx, vy are
    roll and pitch (degrees, right-handed) at height z; TILT_THRUST: so, and z is the thrust, PWM. Motors off: every
    axis is disabled and the thrust is 0.
    """
    kind, flies = row[MODE], row[MOTORS] > 0.5
    across = controller.DISABLED
    if flies and kind < 1.5:
        across = controller.ABSOLUTE if kind > 0.5 else controller.VELOCITY
    tilted = controller.ABSOLUTE if flies and kind > 1.5 else controller.DISABLED
    out.mode[controller.X], out.mode[controller.Y] = across, across
    out.mode[controller.Z] = controller.ABSOLUTE if flies and kind < 2.5 else controller.DISABLED
    out.mode[controller.ROLL], out.mode[controller.PITCH] = tilted, tilted
    out.mode[controller.YAW] = controller.ABSOLUTE if flies else controller.DISABLED
    out.velocity_body = 0
    out.position[0], out.position[1], out.position[2] = row[X], row[Y], row[Z]
    out.attitude[2] = math.degrees(row[YAW])
    for i in range(3):
        out.velocity[i], out.rate[i] = 0.0, 0.0
    if kind > 1.5:
        out.attitude[0], out.attitude[1] = row[VX], -row[VY]  # the firmware's pitch is nose up
    else:
        out.velocity[0], out.velocity[1] = row[VX], row[VY]
        out.attitude[0], out.attitude[1] = 0.0, 0.0
    out.thrust = row[Z] if flies and kind > 2.5 else 0.0
