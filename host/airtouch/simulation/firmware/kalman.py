"""The extended Kalman filter: position, velocity in body axes, attitude error; attitude as a quaternion.

Order of calls at a millisecond's tick: `predict` when due, `process_noise`, `take_imu`, the corrections of
`measurement` when there is a reading, `finalize`. Units SI; the accelerometer reads +g at rest.
Source: Mueller, Hehn, D'Andrea, Covariance Correction Step for Kalman Filtering with an Attitude, 2017;
Mueller, Hamer, D'Andrea, Fusing ultra-wideband range measurements with accelerometers and rate gyroscopes, 2015.
"""

import math

import numpy as np

from airtouch.simulation.compiled import jit

_F = np.float64
STATE = np.dtype([
    ("x", _F, (3,)),  # m, position, world
    ("v", _F, (3,)),  # m/s, velocity, body
    ("d", _F, (3,)),  # rad, attitude error, not yet in q
    ("q", _F, (4,)),  # attitude
    ("home", _F, (4,)),  # attitude at the start
    ("r", _F, (3, 3)),  # rotation body to world, of q
    ("p", _F, (9, 9)),  # covariance of x, v, d
    ("acc_sum", _F, (3,)),  # of the IMU's samples since the last prediction
    ("gyro_sum", _F, (3,)),
    ("samples", np.int64),  # their number
    ("acc", _F, (3,)),  # m/s^2, the last sample
    ("gyro", _F, (3,)),  # rad/s
    ("updated", np.int64),  # 1 where d or q changed since `finalize`
    ("f", _F, (9, 6)),  # columns 3 to 8 of the transition matrix
    ("t", _F, (9, 9)),  # working space
    ("column", _F, (9,)),  # working space
])
Z = 2  #: row of the covariance
# The next four are those of crazyflie-firmware's kalman_core.c.
MOST_VARIANCE, LEAST_VARIANCE = 100.0, 1e-6  #: bounds of every variance, in its state's unit squared
MOVED_RAD = 1e-4  #: rad, attitude error above which it is moved into the quaternion
MOST_ERROR_RAD = 10.0  #: rad, attitude error from which on it is dropped instead
TINY = 1e-6  #: keeps lengths from being zero


@jit
def begin(settings, est, x, y, z, q):
    """Start at a position with an attitude (4,) and the firmware's own initial uncertainty."""
    k = settings.kalman
    est.x[0], est.x[1], est.x[2] = x, y, z
    for i in range(4):
        est.q[i], est.home[i] = q[i], q[i]
    for i in range(3):
        est.v[i], est.d[i] = 0.0, 0.0
        est.acc_sum[i], est.gyro_sum[i] = 0.0, 0.0
        for j in range(3):
            est.r[i, j] = 1.0 if i == j else 0.0
    for i in range(9):
        for j in range(9):
            est.p[i, j] = 0.0
    est.p[0, 0], est.p[1, 1], est.p[2, 2] = k.std_xy_m ** 2, k.std_xy_m ** 2, k.std_z_m ** 2
    for i in range(3):
        est.p[3 + i, 3 + i], est.p[6 + i, 6 + i] = k.std_velocity_mps ** 2, k.std_attitude_rad ** 2
    est.samples, est.updated = 0, 0


@jit
def take_imu(est, acc, gyro):
    """Add a sample of the IMU to the mean since the last prediction: specific force (3,) and rates (3,)."""
    for i in range(3):
        est.acc[i], est.gyro[i] = acc[i], gyro[i]
        est.acc_sum[i] += acc[i]
        est.gyro_sum[i] += gyro[i]
    est.samples += 1


@jit
def predict(settings, est, dt, flying, gravity):
    """Predict the state dt seconds ahead, from the mean of the samples since the last prediction."""
    share = 1.0 / max(est.samples, 1)
    ax, ay, az = est.acc_sum[0] * share, est.acc_sum[1] * share, est.acc_sum[2] * share
    wx, wy, wz = est.gyro_sum[0] * share, est.gyro_sum[1] * share, est.gyro_sum[2] * share
    for i in range(3):
        est.acc_sum[i], est.gyro_sum[i] = 0.0, 0.0
    est.samples = 0
    _linearize(est, wx, wy, wz, dt, gravity)
    _spread(est)
    if flying:  # in the air, thrust is all that the accelerometer is trusted with
        ax, ay = 0.0, 0.0
    r, x, v = est.r, est.x, est.v
    u, w, c = v[0], v[1], v[2]
    half = 0.5 * dt * dt
    mx, my, mz = u * dt + ax * half, w * dt + ay * half, c * dt + az * half
    for i in range(3):
        x[i] += r[i, 0] * mx + r[i, 1] * my + r[i, 2] * mz
    x[2] -= gravity * half
    v[0] = u + dt * (ax + wz * w - wy * c - gravity * r[2, 0])
    v[1] = w + dt * (ay - wz * u + wx * c - gravity * r[2, 1])
    v[2] = c + dt * (az + wy * u - wx * w - gravity * r[2, 2])
    _turn(est.q, dt * wx, dt * wy, dt * wz)
    if not flying:
        keep = settings.kalman.reversion
        for i in range(4):
            est.q[i] += keep * (est.home[i] - est.q[i])
        _unit(est.q)
    est.updated = 1


@jit
def _linearize(est, wx, wy, wz, dt, gravity):
    """Columns 3 to 8 of the transition matrix into f; column 0 to 2 are the identity's."""
    f, r, v = est.f, est.r, est.v
    for i in range(3):
        a, b, c = dt * r[i, 0], dt * r[i, 1], dt * r[i, 2]
        f[i, 0], f[i, 1], f[i, 2] = a, b, c
        f[i, 3], f[i, 4], f[i, 5] = c * v[1] - b * v[2], a * v[2] - c * v[0], b * v[0] - a * v[1]
    tx, ty, tz = dt * wx, dt * wy, dt * wz
    gx, gy, gz = gravity * dt * r[2, 0], gravity * dt * r[2, 1], gravity * dt * r[2, 2]
    f[3, 0], f[3, 1], f[3, 2], f[3, 3], f[3, 4], f[3, 5] = 1.0, tz, -ty, 0.0, gz, -gy
    f[4, 0], f[4, 1], f[4, 2], f[4, 3], f[4, 4], f[4, 5] = -tz, 1.0, tx, -gz, 0.0, gx
    f[5, 0], f[5, 1], f[5, 2], f[5, 3], f[5, 4], f[5, 5] = ty, -tx, 1.0, gy, -gx, 0.0
    _error_turn(f, 0.5 * tx, 0.5 * ty, 0.5 * tz)


@jit
def _error_turn(f, a, b, c):
    """How the covariance of the attitude error turns by half angles (a, b, c), to second order: rows 6 to 8."""
    f[6, 3], f[6, 4], f[6, 5] = 1.0 - 0.5 * (b * b + c * c), c + 0.5 * a * b, -b + 0.5 * a * c
    f[7, 3], f[7, 4], f[7, 5] = -c + 0.5 * a * b, 1.0 - 0.5 * (a * a + c * c), a + 0.5 * b * c
    f[8, 3], f[8, 4], f[8, 5] = b + 0.5 * a * c, -a + 0.5 * b * c, 1.0 - 0.5 * (a * a + b * b)


@jit
def _spread(est):
    """P = F P F' with F = [[1, A, B], [0, C, D], [0, 0, E]] in blocks of 3.

    est.f holds columns 3 to 8 of F, and a to g are what they are multiplied by. Zeros are left out.
    """
    p, t, f = est.p, est.t, est.f
    for j in range(9):
        a, b, c, d, e, g = p[3, j], p[4, j], p[5, j], p[6, j], p[7, j], p[8, j]
        for i in range(3):
            t[i, j] = (p[i, j] + f[i, 0] * a + f[i, 1] * b + f[i, 2] * c + f[i, 3] * d + f[i, 4] * e
                       + f[i, 5] * g)
        for i in range(3, 6):
            t[i, j] = f[i, 0] * a + f[i, 1] * b + f[i, 2] * c + f[i, 3] * d + f[i, 4] * e + f[i, 5] * g
        for i in range(6, 9):
            t[i, j] = f[i, 3] * d + f[i, 4] * e + f[i, 5] * g
    for i in range(9):
        a, b, c, d, e, g = t[i, 3], t[i, 4], t[i, 5], t[i, 6], t[i, 7], t[i, 8]
        for j in range(i, 9):
            value = d * f[j, 3] + e * f[j, 4] + g * f[j, 5]
            if j < 6:
                value += a * f[j, 0] + b * f[j, 1] + c * f[j, 2]
            if j < 3:
                value += t[i, j]
            if j > i:
                value = min(value, MOST_VARIANCE)
            p[i, j], p[j, i] = value, value


@jit
def process_noise(settings, est, dt):
    """Add the process noise of dt seconds. Its square root grows with dt: ten short steps are not one long one."""
    k, p = settings.kalman, est.p
    for i in range(3):
        acc = k.noise_acc_z_mps2 if i == Z else k.noise_acc_xy_mps2
        _grow(p, i, acc * dt * dt)
        _grow(p, 3 + i, acc * dt)
        _grow(p, 6 + i, k.noise_gyro_radps * dt)


@jit
def _grow(p, i, std):
    p[i, i] = min(max(p[i, i] + std * std, LEAST_VARIANCE), MOST_VARIANCE)


@jit
def finalize(est):
    """Move the attitude error into the quaternion, and the rotation matrix with it."""
    if not est.updated:
        return
    d, p, f = est.d, est.p, est.f
    largest = max(max(abs(d[0]), abs(d[1])), abs(d[2]))
    if MOVED_RAD < largest < MOST_ERROR_RAD:
        _turn(est.q, d[0], d[1], d[2])
        _error_turn(f, 0.5 * d[0], 0.5 * d[1], 0.5 * d[2])
        for j in range(9):
            a, b, c = p[6, j], p[7, j], p[8, j]
            for i in range(6, 9):
                p[i, j] = f[i, 3] * a + f[i, 4] * b + f[i, 5] * c
        for i in range(9):
            a, b, c = p[i, 6], p[i, 7], p[i, 8]
            for j in range(6, 9):
                p[i, j] = f[j, 3] * a + f[j, 4] * b + f[j, 5] * c
        _bound(p)
    d[0], d[1], d[2] = 0.0, 0.0, 0.0
    w, x, y, z, r = est.q[0], est.q[1], est.q[2], est.q[3], est.r
    r[0, 0], r[0, 1], r[0, 2] = w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)
    r[1, 0], r[1, 1], r[1, 2] = 2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)
    r[2, 0], r[2, 1], r[2, 2] = 2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z
    est.updated = 0


@jit
def _bound(p):
    """Keep the covariance symmetric and within its bounds."""
    for i in range(9):
        for j in range(i, 9):
            value = min(0.5 * (p[i, j] + p[j, i]), MOST_VARIANCE)
            if i == j:
                value = max(value, LEAST_VARIANCE)
            p[i, j], p[j, i] = value, value


@jit
def _turn(q, x, y, z):
    """Turn the quaternion by the rotation vector (x, y, z), body axes."""
    angle = math.sqrt(x * x + y * y + z * z) + TINY
    c, s = math.cos(0.5 * angle), math.sin(0.5 * angle) / angle
    x, y, z = s * x, s * y, s * z
    a, b, e, g = q[0], q[1], q[2], q[3]
    q[0], q[1] = c * a - x * b - y * e - z * g, x * a + c * b + z * e - y * g
    q[2], q[3] = y * a - z * b + c * e + x * g, z * a + y * b - x * e + c * g
    _unit(q)


@jit
def _unit(q):
    scale = 1.0 / (math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]) + TINY)
    for i in range(4):
        q[i] *= scale


@jit
def lost(settings, est):
    """Whether the estimate is outside the firmware's bounds; the firmware then restarts it."""
    k = settings.kalman
    for i in range(3):
        if abs(est.x[i]) > k.most_position_m or abs(est.v[i]) > k.most_velocity_mps:
            return True
    return False


@jit
def world_velocity(est, out):
    """Write the velocity in world axes, m/s, into out (3,)."""
    for i in range(3):
        out[i] = est.r[i, 0] * est.v[0] + est.r[i, 1] * est.v[1] + est.r[i, 2] * est.v[2]

