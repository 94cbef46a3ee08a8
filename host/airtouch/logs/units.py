"""Units of the Crazyflie's log variables in SI."""

import numpy as np

GRAVITY = 9.81  #: m/s^2 in one g, as the Crazyflie firmware counts it
GYRO_LSB = np.deg2rad(2000 * 2 / 65536)  #: rad/s in one LSB of `gyro.xRaw`
INVALID_RANGE_MM = 32767  #: mm, reading of a range sensor that measured nothing


def range_m(millimetres: np.ndarray, zero_is_invalid: bool = False) -> np.ndarray:
    """Ranges in metres, (n,), NaN where invalid: negative, or 32767 mm and more.

    A down range of 0 is valid: the surface is too near to measure. A Multi-ranger
    value of 0 is invalid (zero_is_invalid): the deck or the sensor did not answer.
    """
    invalid = (millimetres >= INVALID_RANGE_MM) | (millimetres < 0)
    if zero_is_invalid:
        invalid |= millimetres == 0
    return np.where(invalid, np.nan, millimetres * 1e-3)
