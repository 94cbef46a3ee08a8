"""From thrust, roll, pitch and yaw commands to four motor commands, and their cap."""

from airtouch.simulation.compiled import jit

MOST = 65535.0  #: the firmware's largest motor command, UINT16_MAX
MOST_TURN = 32767.0  #: its largest roll, pitch or yaw command, INT16_MAX


@jit
def to_int16(value):
    """A command as the firmware keeps it: cut to the range of an int16, then to a whole number towards zero."""
    return float(int(min(max(value, -MOST_TURN), MOST_TURN)))


@jit
def mix(thrust, roll, pitch, yaw, out):
    """Motor commands (4,) before the cap. pitch is nose up; yaw has the controller's sign (negated)."""
    r, p = float(int(0.5 * roll)), float(int(0.5 * pitch))
    out[0] = float(int(thrust - r + p + yaw))
    out[1] = float(int(thrust - r - p - yaw))
    out[2] = float(int(thrust + r - p + yaw))
    out[3] = float(int(thrust + r + p - yaw))


@jit
def cap(motors):
    """Limit commands (4,) to 0..65535; attitude has priority over thrust."""
    over = max(max(max(motors[0], motors[1]), max(motors[2], motors[3])) - MOST, 0.0)
    for i in range(4):
        motors[i] = max(motors[i] - over, 0.0)
