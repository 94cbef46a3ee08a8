"""Down range, optical flow and Multi-ranger: readings that the firmware and the log get."""

import math

import numpy as np

from airtouch.simulation import sensors, world
from airtouch.simulation.compiled import jit
from airtouch.simulation.firmware import kalman, range_module
from airtouch.simulation.random_stream import normals
from airtouch.simulation.rotation import euler, rotate_back

RANGE_MS, FLOW_MS = 7, 3  #: ticks of the first down range reading and of the first flow reading
RANGES, FLOWS = 16, 64  #: readings that the delay lines hold
#: share of the new surface in a reading that saw two: where it is more than this, a reading beyond an edge overshoots
OVERSHOOT_SHARE = 0.5
LAST = 1000.0  #: s; where nothing has changed below for so long


@jit
def uniform_of(normal):
    """A uniform number in 0..1 from a standard normal one: its cumulative probability."""
    return 0.5 * math.erfc(-normal / math.sqrt(2.0))


@jit
def mixed_share(drawn, leaving):
    """How far the one reading on which an edge passes has gone from the old distance (0) to the new one (1).

    drawn: uniform in 0..1, the part of the 25 ms of ranging that the new surface was below. Onto a higher surface the
    reading follows it. Leaving one, it lies in the lower half or overshoots by up to a half
    (authors' flights, folds 0 to 2: 25 of 53 in 0.05 to 0.5, 23 above 1.05, none from 0.5 to 0.9).
    """
    return drawn + 0.5 if leaving and drawn > OVERSHOOT_SHARE else drawn


@jit
def look(plant, memory, ground, state, now, stream):
    """One measurement of the down range at time now (s): distance along the beam into the delay line.

    ground: corners, first, surface, box of a World. memory.top is the height of the surface it saw.
    """
    corners, first, surface, box = ground
    normals(stream, memory.other_normals[:])
    eye, patch = state[2] - plant.range_below_rotors, memory.patch[:]
    spot = max(sensors.CONE_TANGENT * (eye - memory.ground), 0.002)
    world.below(corners, first, surface, box, state[0], state[1], eye, spot, patch)
    near = patch[world.UPPER_TOP] if patch[world.COVER] > 0.0 else patch[world.LOWER_TOP]
    spot = max(sensors.CONE_TANGENT * (eye - near), 0.002)
    world.below(corners, first, surface, box, state[0], state[1], eye, spot, patch)
    top = patch[world.UPPER_TOP] if patch[world.COVER] >= sensors.CONE_COVER else patch[world.LOWER_TOP]
    memory.beneath = top
    if plant.range_reach > 0.0:
        world.below(corners, first, surface, box, state[0], state[1], eye, plant.range_reach, patch)
        top = patch[world.UPPER_TOP] if patch[world.COVER] > 0.0 else patch[world.LOWER_TOP]
    tilt = max(1.0 - 2.0 * (state[7] * state[7] + state[8] * state[8]), 0.3)  # cosine between beam and plumb
    true = (eye - top) / tilt
    if top != memory.top:
        memory.changed, memory.rose = now, 1.0 if top > memory.top else 0.0
        memory.offset += top - memory.top  # optical flow sees it at once, however late the reading is
    decay = math.exp(-0.001 * plant.firmware.periods.range_ms / plant.range_drift_time)
    fresh = math.sqrt(1.0 - decay * decay) * plant.range_drift
    memory.drift[2] = decay * memory.drift[2] + fresh * memory.other_normals[1]
    error = memory.drift[2] * true + plant.range_bias * math.exp(-true / plant.range_bias_fade)
    dip = plant.range_dip * memory.rose * math.exp((memory.changed - now) / plant.range_dip_time)
    error += dip * math.exp(-true / plant.range_dip_fade) if plant.range_dip_fade > 0.0 else dip
    if top != memory.top and uniform_of(memory.other_normals[3]) < plant.range_mixed:
        error += (mixed_share(uniform_of(memory.other_normals[2]), top < memory.top) - 1.0) * (memory.top - top) / tilt
    row = memory.looks & (RANGES - 1)
    down = max(true + error + plant.range_noise * memory.other_normals[0], 0.0)
    memory.distances[row] = down if down <= sensors.MAX_RANGE_M else np.nan
    memory.tops[row] = top
    memory.kicks[row] = 0.0
    if top != memory.top:
        memory.kicks[row] = plant.range_kick if top < memory.top else -plant.range_kick
    memory.top = top
    memory.looks += 1


@jit
def range_reading(plant, memory, ground, tick, state, now, stream, reading):
    """The down range at a tick (ms): measures when due and fills distance and distance_std of the reading (NaN: none).

    A reading reaches log and estimator plant.range_delay after it was measured, by way of the firmware's
    range module.
    """
    firmware = plant.firmware
    period, late = firmware.periods.range_ms, int(1000.0 * plant.range_delay + 0.5)
    reading.distance = np.nan
    if tick >= RANGE_MS and (tick - RANGE_MS) % period == 0:
        look(plant, memory, ground, state, now, stream)
    since = tick - RANGE_MS - late
    if since < 0 or since % period != 0:
        return
    row = (since // period) & (RANGES - 1)
    memory.down = memory.distances[row]
    if math.isnan(memory.down) or memory.down >= firmware.range.most_m:
        return
    passed = range_module.compensated(firmware, memory.module, memory.down, memory.tops[row])
    memory.offset = passed - memory.down + memory.top - memory.tops[row]
    if memory.tops[row] > memory.ground:
        passed -= plant.range_residual
    reading.distance = passed + memory.kicks[row]
    reading.distance_std = kalman.range_std(firmware, reading.distance)


@jit
def flow_reading(plant, memory, tick, state, now, stream, reading):
    """Optical flow at a tick (ms): counts forward and left of the reading (NaN: none).

    Counts follow from the velocity over ground, the body's rates and the distance to what is below, scaled to the
    height that the firmware divides by (plant.flow_share: how far they are not).
    """
    s = plant.firmware.flow
    period = plant.firmware.periods.flow_ms
    reading.forward = np.nan
    if tick < FLOW_MS or (tick - FLOW_MS) % period != 0:
        return
    dt = 0.001 * period
    normals(stream, memory.other_normals[:])
    decay = math.exp(-dt / plant.flow_noise_time)
    fresh = math.sqrt(1.0 - decay * decay)
    for i in range(2):
        memory.drift[i] = decay * memory.drift[i] + fresh * plant.flow_noise[i] * memory.other_normals[i]
    distance = state[2] - plant.range_below_rotors - memory.beneath
    near = max(distance, plant.flow_focus)
    far = max(near + (memory.beneath - memory.top) + memory.offset, near)
    share, since = plant.flow_share, now - memory.changed - plant.flow_transient_wait
    if since >= 0.0 and distance >= plant.flow_transient_above:
        share += plant.flow_transient * math.exp(-since / plant.flow_transient_time)
    per_metre = (1.0 - share) / far + share / near
    ahead, left, _ = rotate_back(state[6:10], state[3], state[4], state[5])
    upright = 1.0 - 2.0 * (state[7] * state[7] + state[8] * state[8])
    pixels = dt * s.pixels / s.aperture_rad
    number = (tick - FLOW_MS) // period
    row = number & (FLOWS - 1)
    memory.flows[row, 0] = s.counts_per_pixel * pixels * (
        upright * ahead * per_metre + memory.drift[0] - state[11])
    memory.flows[row, 1] = s.counts_per_pixel * pixels * (
        upright * left * per_metre + memory.drift[1] + state[10])
    late = plant.flow_delay / dt
    if number < late:
        return
    forward, left = sensors.delayed(memory.flows, number, late, 0), sensors.delayed(memory.flows, number, late, 1)
    if max(abs(forward), abs(left)) < s.most_counts:
        reading.forward, reading.left, reading.dt, reading.std = forward, left, dt, s.std_counts


@jit
def walls(memory, room, state):
    """The Multi-ranger: distances to the walls of room (4,), front, back, left, right."""
    _, _, yaw = euler(state[6:10])
    for i in range(4):
        turn = (0.0, math.pi, 0.5 * math.pi, -0.5 * math.pi)[i]
        far = sensors.wall_distance(state[0], state[1], yaw + turn, room)
        memory.ranges[i] = far if far <= sensors.MAX_RANGE_M else np.nan
