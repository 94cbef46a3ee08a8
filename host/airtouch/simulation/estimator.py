"""State estimate from IMU, optical flow and down range: a fixed-gain observer.

Stands for the firmware's Kalman filter as far as the closed loop needs it: gyro and
accelerometer predict; flow corrects velocity and tilt, the down range corrects height and
climb. The platform compensation of the paper's fork (a fixed desk height added to the
range after a drop of more than 0.30 m) is in the range that it is given.
"""

import math

from airtouch.simulation.compiled import jit

ROLL, PITCH, YAW, V, P, SIZE = 0, 1, 2, 3, 6, 9  #: places: angles (rad), velocity, position (3 each)
FLOW_TO_VELOCITY = 0.04  #: per flow sample of 10 ms
FLOW_TO_TILT = 0.004  #: rad per m/s and sample
RANGE_TO_HEIGHT = 0.25  #: per range reading of 25 ms
RANGE_TO_CLIMB = 1.2  #: 1/s per reading


@jit
def predict(est, rates, acc, gravity, h):
    """Advance the estimate by h with rates (rad/s) and specific force (m/s^2), body axes.

    Returns the specific force in world axes.
    """
    sr, cr = math.sin(est[ROLL]), math.cos(est[ROLL])
    sp, cp = math.sin(est[PITCH]), math.cos(est[PITCH])
    sy, cy = math.sin(est[YAW]), math.cos(est[YAW])
    cp_safe = max(cp, 0.05)
    swing = sr * rates[1] + cr * rates[2]
    est[ROLL] += h * (rates[0] + swing * sp / cp_safe)
    est[PITCH] += h * (cr * rates[1] - sr * rates[2])
    est[YAW] += h * swing / cp_safe
    level_x = cp * acc[0] + sp * (sr * acc[1] + cr * acc[2])
    level_y = cr * acc[1] - sr * acc[2]
    up = -sp * acc[0] + cp * (sr * acc[1] + cr * acc[2])
    east, north = cy * level_x - sy * level_y, sy * level_x + cy * level_y
    for i in range(3):
        est[P + i] += h * est[V + i]
    est[V] += h * east
    est[V + 1] += h * north
    est[V + 2] += h * (up - gravity)
    return east, north, up


@jit
def correct_flow(est, vx, vy):
    """Optical flow: velocity over ground (m/s, world axes)."""
    ex, ey = vx - est[V], vy - est[V + 1]
    est[V] += FLOW_TO_VELOCITY * ex
    est[V + 1] += FLOW_TO_VELOCITY * ey
    cy, sy = math.cos(est[YAW]), math.sin(est[YAW])
    est[PITCH] += FLOW_TO_TILT * (cy * ex + sy * ey)
    est[ROLL] -= FLOW_TO_TILT * (cy * ey - sy * ex)


@jit
def correct_range(est, height):
    """Down range, turned into a height over the floor (m)."""
    error = height - est[P + 2]
    est[P + 2] += RANGE_TO_HEIGHT * error
    est[V + 2] += RANGE_TO_CLIMB * error
