"""Units of the Crazyflie's log variables in SI."""

import numpy as np

GRAVITY = 9.81  #: m/s^2 in one g, as the Crazyflie firmware counts it
GYRO_LSB = np.deg2rad(2000 * 2 / 65536)  #: rad/s in one LSB of `gyro.xRaw`
NO_RANGE_MM = 32767  #: mm, reading of a Multi-ranger's sensor that measured nothing
OUTLIER_MM = 5000  #: mm; the firmware's estimator takes no down range from here on (RANGE_OUTLIER_LIMIT in zranger2.c)


def down_range_m(millimetres: np.ndarray) -> np.ndarray:
    """Down ranges in metres, (n,), NaN where invalid: negative, or 5 m and more.

    The firmware logs such readings before it rejects them. 0 is valid: the surface is too near to measure.
    """
    return np.where((millimetres >= 0) & (millimetres < OUTLIER_MM), millimetres * 1e-3, np.nan)


def side_range_m(millimetres: np.ndarray) -> np.ndarray:
    """Multi-ranger readings in metres, (n,), NaN where invalid: 32767 mm and more, negative, or 0 (no answer)."""
    return np.where((millimetres > 0) & (millimetres < NO_RANGE_MM), millimetres * 1e-3, np.nan)
