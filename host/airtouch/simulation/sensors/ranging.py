"""Down range and optical flow: readings that the firmware and the log get."""

import math

import numpy as np

from airtouch.simulation.body.rotation import rotate_back
from airtouch.simulation.compiled import jit
from airtouch.simulation.firmware import measurement, range_module
from airtouch.simulation.flight_plan import world
from airtouch.simulation.random_generator import normals
from airtouch.simulation.sensors import filters

_F = np.float64
RANGE_MS, FLOW_MS = 7, 3  #: ticks of the first down range reading and of the first flow reading
RANGES, FLOWS = 16, 64  #: readings that the delay lines hold
LEAST_COSINE = 0.3  #: between beam and plumb, a tilt of 73 degrees; chosen, so that the distance stays finite
MAX_RANGE_M = 4.0  #: beyond it a time-of-flight sensor says "invalid"
CONE_COVER = 0.5  #: the down range sees the higher surface once it fills this share of the spot
CONE_TANGENT = 0.12  #: spot radius over distance (a half angle of 7 degrees carries most of the light)
LEAST_SPOT_M = 0.002  #: radius of the spot where the sensor stands on the ground, so that shares are defined
#: share of the new surface in a reading that saw two: where it is more than this, a reading beyond an edge overshoots
OVERSHOOT_SHARE = 0.5
FIRST_DOWN_M = 0.01  #: m, down range that is logged before the first reading; chosen
LONG_AGO_S = 1000.0  #: since the last change below, at the start of a flight
STATE = np.dtype([
    ("count", np.int64),  # down range measurements so far
    ("distance", _F, (RANGES,)),  # delay line of them, m along the beam
    ("top", _F, (RANGES,)),  # m, height of the surface that each saw
    ("kick", _F, (RANGES,)),  # m, error of each that the estimator alone gets
    ("flow", _F, (FLOWS, 2)),  # delay line of flow counts, forward and left
    ("seen_top", _F),  # m, height of the surface that the down range saw last
    ("below_top", _F),  # m, of the surface below
    ("start_top", _F),  # m, of the surface that it started from
    ("changed_s", _F),  # when seen_top changed last
    ("rise", _F),  # 1 where seen_top rose then, 0 where it fell
    ("down", _F),  # m, down range as logged
    ("offset", _F),  # m, what the range module added to its last reading
    ("range_drift", _F),  # error over distance
    ("flow_drift", _F, (2,)),  # 1/s, error of velocity over distance, forward and left
    ("normals", _F, (4,)),  # working space
])


@jit
def begin(s, top):
    """Set the sensors for a vehicle that stands on a surface of that height, m."""
    s.start_top = s.seen_top = s.below_top = top
    s.down, s.changed_s = FIRST_DOWN_M, -LONG_AGO_S


@jit
def uniform_of(normal):
    """A uniform number in 0..1 from a standard normal one: its cumulative probability."""
    return 0.5 * math.erfc(-normal / math.sqrt(2.0))


@jit
def mixed_share(drawn, leaving):
    """Position of the reading at an edge between the old distance (0) and the new one (1).

    drawn: uniform in 0..1, the part of the 25 ms of ranging that the new surface was below. Onto a higher surface the
    reading follows it. Leaving one, it lies in the lower half or overshoots by up to a half
    (authors' flights, folds 0 to 2: 25 of 53 in 0.05 to 0.5, 23 above 1.05, none from 0.5 to 0.9).
    """
    return drawn + 0.5 if leaving and drawn > OVERSHOOT_SHARE else drawn


@jit
def _surface(ground, x, y, z, radius, least_cover):
    """Height (m) of the surface that a spot of `radius` sees: the higher one where it covers more than least_cover."""
    lower, upper, cover = world.below(ground, x, y, z, radius)
    return ground.surface[upper if cover > least_cover else lower, world.TOP]


@jit
def _below(s, ground, x, y, eye):
    """Height (m) of the surface that fills most of the beam's spot, from a sensor `eye` m high."""
    spot = max(CONE_TANGENT * (eye - s.start_top), LEAST_SPOT_M)
    near = _surface(ground, x, y, eye, spot, 0.0)
    spot = max(CONE_TANGENT * (eye - near), LEAST_SPOT_M)
    lower, upper, cover = world.below(ground, x, y, eye, spot)
    return ground.surface[upper if cover >= CONE_COVER else lower, world.TOP]


@jit
def _error(plant, s, now, true):
    """Error (m) of a measurement of the distance `true` (m) at time now (s): drift, bias near a surface, dip."""
    decay = math.exp(-0.001 * plant.firmware.periods.range_ms / plant.range_drift_time)
    fresh = math.sqrt(1.0 - decay * decay) * plant.range_drift
    s.range_drift = decay * s.range_drift + fresh * s.normals[1]
    error = s.range_drift * true + plant.range_bias * math.exp(-true / plant.range_bias_fade)
    dip = plant.range_dip * s.rise * math.exp((s.changed_s - now) / plant.range_dip_time)
    error += dip * math.exp(-true / plant.range_dip_fade) if plant.range_dip_fade > 0.0 else dip
    return error


@jit
def measure(plant, state, ground, generator):
    """One measurement of the down range: distance along the beam, its surface and its kick into the delay lines.

    ground: a World. The surface that it saw stays in state.ranging.seen_top.
    """
    s, pose, now = state.ranging, state.body.state, state.time_s
    normals(generator, s.normals[:])
    eye = pose[2] - plant.range_below_rotors
    top = s.below_top = _below(s, ground, pose[0], pose[1], eye)
    if plant.range_reach > 0.0:
        top = _surface(ground, pose[0], pose[1], eye, plant.range_reach, 0.0)
    tilt = max(1.0 - 2.0 * (pose[7] * pose[7] + pose[8] * pose[8]), LEAST_COSINE)  # cosine between beam and plumb
    true = (eye - top) / tilt
    changed = top != s.seen_top
    if changed:
        s.changed_s, s.rise = now, 1.0 if top > s.seen_top else 0.0
        s.offset += top - s.seen_top  # optical flow sees it at once, however late the reading is
    error = _error(plant, s, now, true)
    if changed and uniform_of(s.normals[3]) < plant.range_mixed:
        error += (mixed_share(uniform_of(s.normals[2]), top < s.seen_top) - 1.0) * (s.seen_top - top) / tilt
    row = s.count & (RANGES - 1)
    down = max(true + error + plant.range_noise * s.normals[0], 0.0)
    s.distance[row] = down if down <= MAX_RANGE_M else np.nan
    s.top[row] = top
    s.kick[row] = 0.0
    if changed:
        s.kick[row] = plant.range_kick if top < s.seen_top else -plant.range_kick
    s.seen_top = top
    s.count += 1


@jit
def range_reading(plant, state, ground, tick, generator):
    """The down range at a tick (ms): measures when due and fills distance and distance_std of the firmware's reading.

    A reading (NaN: none) reaches log and estimator plant.range_delay after it was measured, by way of the firmware's
    range module.
    """
    s, release, reading = state.ranging, plant.firmware, state.firmware.reading
    period, late = release.periods.range_ms, int(1000.0 * plant.range_delay + 0.5)
    reading.distance = np.nan
    if tick >= RANGE_MS and (tick - RANGE_MS) % period == 0:
        measure(plant, state, ground, generator)
    since = tick - RANGE_MS - late
    if since < 0 or since % period != 0:
        return
    row = (since // period) & (RANGES - 1)
    s.down = s.distance[row]
    if math.isnan(s.down) or s.down >= release.range.most_m:
        return
    passed = range_module.compensated(release, state.firmware.range_module, s.down, s.top[row])
    s.offset = passed - s.down + s.seen_top - s.top[row]
    if s.top[row] > s.start_top:
        passed -= plant.range_residual
    reading.distance = passed + s.kick[row]
    reading.distance_std = measurement.range_std(release, reading.distance)


@jit
def flow_reading(plant, state, tick, generator):
    """Optical flow at a tick (ms): counts forward and left of the firmware's reading (NaN: none)."""
    s, model, reading = state.ranging, plant.firmware.flow, state.firmware.reading
    period = plant.firmware.periods.flow_ms
    reading.forward = np.nan
    if tick < FLOW_MS or (tick - FLOW_MS) % period != 0:
        return
    dt, number = 0.001 * period, (tick - FLOW_MS) // period
    normals(generator, s.normals[:])
    decay = math.exp(-dt / plant.flow_noise_time)
    fresh = math.sqrt(1.0 - decay * decay)
    for i in range(2):
        s.flow_drift[i] = decay * s.flow_drift[i] + fresh * plant.flow_noise[i] * s.normals[i]
    _count(plant, state, dt, number & (FLOWS - 1))
    late = plant.flow_delay / dt
    if number < late:
        return
    forward, left = filters.delayed(s.flow, number, late, 0), filters.delayed(s.flow, number, late, 1)
    if max(abs(forward), abs(left)) < model.most_counts:
        reading.forward, reading.left, reading.dt, reading.std = forward, left, dt, model.std_counts


@jit
def _count(plant, state, dt, row):
    """Counts of optical flow over dt seconds, forward and left, into a row of the delay line.

    They follow from the velocity over ground, the body's rates and the distance to what is below, scaled to the
    height that the firmware divides by (plant.flow_share: how far they are not).
    """
    s, pose, model = state.ranging, state.body.state, plant.firmware.flow
    distance = pose[2] - plant.range_below_rotors - s.below_top
    near = max(distance, plant.flow_focus)
    far = max(near + (s.below_top - s.seen_top) + s.offset, near)
    share, since = plant.flow_share, state.time_s - s.changed_s - plant.flow_transient_wait
    if since >= 0.0 and distance >= plant.flow_transient_above:
        share += plant.flow_transient * math.exp(-since / plant.flow_transient_time)
    per_metre = (1.0 - share) / far + share / near
    ahead, left, _ = rotate_back(pose[6:10], pose[3], pose[4], pose[5])
    upright = 1.0 - 2.0 * (pose[7] * pose[7] + pose[8] * pose[8])
    pixels = dt * model.pixels / model.aperture_rad
    s.flow[row, 0] = model.counts_per_pixel * pixels * (upright * ahead * per_metre + s.flow_drift[0] - pose[11])
    s.flow[row, 1] = model.counts_per_pixel * pixels * (upright * left * per_metre + s.flow_drift[1] + pose[10])
