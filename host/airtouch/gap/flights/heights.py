"""Height of each rotor over what is under it: from the down range, else from the position over a flat floor."""

import numpy as np

from airtouch.gap.flights.attitude import smoothed_speed
from airtouch.gap.flights.clock import PERIOD_S
from airtouch.gap.flights.missing import interpolate_missing
from airtouch.logs.flight_log import POSITION, VELOCITY, FlightLog
from airtouch.logs.segments import LEAST_HEIGHT_M

MARKER_M = 0.05  #: height over the floor of a motion-capture marker on a Crazyflie that stands; chosen
COURSE_S = 0.2  #: standard deviation of the Gaussian that smooths velocity before its direction is taken; chosen
MOVING_MPS = 0.05  #: speed up to which the vehicle has no direction of flight; chosen
MOST_AHEAD = 100  #: samples at most by which a rotor passes an edge before or after the range sensor; chosen
LOWEST_PERCENT = 5.0  #: of the readings on the ground: the lowest; chosen, so that some wrong ones do not count
STEP_M = 0.06  #: change of the down range between two samples from which it is a step of the floor; chosen


def rotor_heights(log: FlightLog, body_to_world: np.ndarray, row: np.void, on_ground: np.ndarray) -> np.ndarray | None:
    """Height (n, 4) of each rotor over what is under it, m; None without down range and position.

    body_to_world (n, 3, 3): rotation; row: of the plant (`simulation.flight.prepare`), for where rotors, range sensor
    and legs are; on_ground (n,): bool. Without a down range the floor is taken as flat and the height is that above
    standing, plus the rotors' height then.
    """
    rise = body_to_world[:, 2, :1] * row["rotor_x"] + body_to_world[:, 2, 1:2] * row["rotor_y"]
    if log.has("zrange_m"):
        return _over_steps(log, body_to_world, row, rise)
    if not log.has(POSITION[2]):
        return None
    z = interpolate_missing(log[POSITION[2]])
    return np.maximum((z - standing_z(z, on_ground) + standing_height(row))[:, None] + rise, 0.0)


def standing_height(row: np.void) -> float:
    """Height of the rotors over the floor on which the vehicle stands, m."""
    return row["range_below_rotors"] + row["leg_below_range"]


def _over_steps(log: FlightLog, body_to_world: np.ndarray, row: np.void, rise: np.ndarray) -> np.ndarray:
    """`rotor_heights` from the down range under the middle; rise (n, 4): of each rotor over the middle, m.

    The edge passes under a rotor earlier or later than under the sensor, by the rotor's distance along the path over
    the speed: there the floor is that under the sensor so many samples before or after.
    """
    plumb = np.maximum(body_to_world[:, 2, 2], 0.0)  # cosine between plumb and the beam, which is along the body's axis
    height = (interpolate_missing(log["zrange_m"]) + row["range_below_rotors"]) * plumb
    altitude = _altitude(log, height)
    index, floor = np.arange(len(log), dtype=np.float64), altitude - height
    ahead = _samples_ahead(log, body_to_world, row)
    under_rotors = np.column_stack([np.interp(index + ahead[:, i], index, floor) for i in range(4)])
    return np.maximum(altitude[:, None] - under_rotors + rise, 0.0)


def _samples_ahead(log: FlightLog, body_to_world: np.ndarray, row: np.void) -> np.ndarray:
    """Samples (n, 4) by which each rotor passes a place earlier than the range sensor; 0 where nothing moves."""
    ahead = np.zeros((len(log), 4))
    if log.has(*VELOCITY[:2]):
        velocity = smoothed_speed(log, COURSE_S)
        speed = np.hypot(velocity[:, 0], velocity[:, 1])
        moving = speed > MOVING_MPS
        along = np.einsum("nij,nj->ni", body_to_world[:, :2, :2].transpose(0, 2, 1), velocity)  # in body axes
        way = along[:, :1] * row["rotor_x"] + along[:, 1:] * row["rotor_y"]
        ahead[moving] = way[moving] / speed[moving, None] ** 2 / PERIOD_S
    return np.clip(ahead, -MOST_AHEAD, MOST_AHEAD)


def standing_z(z: np.ndarray, on_ground: np.ndarray) -> float:
    """What z_m (n,), without NaN, reads when the vehicle stands: its median on the ground where the log holds that.

    What is LEAST_HEIGHT_M over the lowest readings there counts as in a hand, also where the estimate has drifted. Else
    the lowest value, at most MARKER_M: a log cut out of a flight may never come down.
    """
    if not on_ground.any():
        return float(min(z.min(), MARKER_M))
    resting = z[on_ground]
    return float(np.median(resting[resting <= np.percentile(resting, LOWEST_PERCENT) + LEAST_HEIGHT_M]))


def _altitude(log: FlightLog, height: np.ndarray) -> np.ndarray:
    """Height over the floor (n,): the logged one, else the down range without its steps."""
    if log.has(POSITION[2]):
        return interpolate_missing(log[POSITION[2]])
    return height[0] + climbed(height, STEP_M)


def climbed(height: np.ndarray, step_m: float) -> np.ndarray:
    """Height (n,), m, gained since the first sample by a down range without its steps, changes of more than step_m."""
    change = np.diff(height, prepend=height[0])
    change[np.abs(change) > step_m] = 0.0
    return np.cumsum(change)
