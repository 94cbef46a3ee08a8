"""One flight as one compiled loop of stages over one memory record.

Order within a step of 2 ms: the IMU gives two samples, down range and flow measure when they are due, the firmware's
estimator runs a tick for each millisecond and its controllers one, the log takes its row (100 Hz), the delayed
command reaches the motors, every effect adds its force and torque at the middle of the step, the body moves (RK4).
"""

import math

from numba import float64, from_dtype, int64, types, uint64

from airtouch.simulation import (
    autopilot,
    battery,
    contact,
    imu,
    kept,
    motors,
    ranging,
    rigid_body,
    sensors,
    surroundings,
)
from airtouch.simulation import signals as at
from airtouch.simulation.compiled import jit
from airtouch.simulation.effects.effect import WrenchFunction
from airtouch.simulation.kept import SLOTS
from airtouch.simulation.plant import DTYPE
from airtouch.simulation.random_stream import normals
from airtouch.simulation.rotation import euler
from airtouch.simulation.sensors import RING

LOG_STEPS = 5  #: physics steps a logged row
OK, NOT_FINITE, UPSET, STRUCK, LOST = range(5)  #: how a flight ended
ENDINGS = ("ok", "a value is not finite", "it turned over", "it struck a surface", "it flew away")
TURN = 2.0 * math.pi
FLOOR_DEPTH_M = 0.015  #: legs this far inside a surface: it struck it
WALLS_STEPS = 50  #: physics steps a reading of the Multi-ranger
(T, ACC, GYRO, PWM, DOWN, RANGES, VBAT, PLACE, SPEED, ANGLES, RPM, ACC_WORLD, COLUMNS) = (
    0, 1, 4, 7, 11, 12, 16, 17, 20, 23, 26, 30, 33)

@jit
def _noise(plant, h):
    """Of the motors' slow and fast noise: what is left of it a step later, and what is drawn anew."""
    slow, fast = math.exp(-h / plant.motor_noise_time), math.exp(-h / plant.motor_hiss_time)
    return slow, math.sqrt(1.0 - slow * slow), fast, math.sqrt(1.0 - fast * fast)


@jit
def _log(plant, memory, t, volts, out):
    """A row (33,) of the log."""
    out[T] = t
    out[ANGLES], out[ANGLES + 1], out[ANGLES + 2] = euler(memory.state[6:10])
    r = memory.est.r
    for i in range(3):
        out[ACC + i], out[GYRO + i] = memory.acc[i], memory.gyro[i]
        out[PLACE + i], out[SPEED + i] = memory.state[i], memory.state[3 + i]
        out[ACC_WORLD + i] = r[i, 0] * memory.acc[0] + r[i, 1] * memory.acc[1] + r[i, 2] * memory.acc[2]
    out[PLACE + 2] -= plant.range_below_rotors
    for i in range(4):
        out[PWM + i], out[RANGES + i] = memory.pwm[i], memory.ranges[i]
        out[RPM + i] = memory.speed[i] * 9.549296585513721
    out[DOWN], out[VBAT] = memory.down, volts


@jit
def _motors(plant, memory, noise, k, h, volts, stream):
    """Delayed command, target speeds, noise of the thrust, phases and battery of physics step k."""
    flicker, speed, phase, normal = memory.flicker, memory.speed, memory.phase, memory.motor_normals[:]
    factor = motors.voltage_factor(plant, volts)
    for i in range(4):
        memory.commands[k & (RING - 1), i] = memory.pwm[i]
        if k == 0:
            for j in range(RING):
                memory.commands[j, i] = memory.pwm[i]
    if plant.motor_hiss > 0.0:
        normals(stream, normal)
        for i in range(4):
            flicker[4 + i] = noise[2] * flicker[4 + i] + noise[3] * normal[i]
    normals(stream, normal)
    power = 0.0
    power_per_speed3 = plant.power_per_thrust15 * plant.thrust_per_speed2 * math.sqrt(plant.thrust_per_speed2)
    for i in range(4):
        command = sensors.delayed(memory.commands, k, plant.actuator_delay / h, i)
        if plant.motor_slowness[i] > 0.0:
            memory.slowed[i] += (command - memory.slowed[i]) * (1.0 - math.exp(-h / plant.motor_slowness[i]))
            command = memory.slowed[i]
        if plant.motor_dead_zone[i] > 0.0:
            if abs(command - memory.held[i]) > plant.motor_dead_zone[i]:
                memory.held[i] = command
            command = memory.held[i]
        memory.target[i] = motors.target_speed(plant, command, factor)
        flicker[i] = noise[0] * flicker[i] + noise[1] * normal[i]
        random = plant.motor_noise * flicker[i] + plant.motor_hiss * flicker[4 + i]
        plant.gain[i] = memory.gain[i] * (1.0 + random)
        power += power_per_speed3 * speed[i] * speed[i] * speed[i]
        if plant.vibration > 0.0:
            turns = (phase[i] + h * speed[i]) / TURN
            phase[i] = TURN * (turns - math.floor(turns))
    memory.charge, memory.volts = battery.drain(plant, memory.charge, power, h)


@jit
def move(plant, memory, ground, effects, used, parameters, effect_streams, constant, noise, k, hover, volts, stream):
    """The vehicle over physics step k under memory.pwm (4,): motors, effects, body.

    How the flight stands (OK or a reason).
    """
    corners, first, surface, box = ground
    h, leg = plant.step, plant.range_below_rotors + plant.leg_below_range
    state, s, force, effect_memory = memory.state[:], memory.signals[:], memory.force[:], memory.effects
    _motors(plant, memory, noise, k, h, volts, stream)

    # effects, at the middle of the step
    for i in range(13):
        memory.middle[i] = state[i] + 0.5 * h * memory.slope[i]
    for i in range(4):
        tau = plant.motor_rise if memory.target[i] > memory.speed[i] else plant.motor_fall
        memory.middle_speed[i] = memory.speed[i] + 0.5 * h / tau * (memory.target[i] - memory.speed[i])
    surroundings.fill(plant, memory.middle, memory.slope, memory.middle_speed, corners, first, surface, box, h,
                      k * h + 0.5 * h, hover, s, memory.patch)
    for i in range(6):
        force[i] = 0.0
    for i in range(used):
        effects[i](parameters[i], s, effect_memory[i], effect_streams[i], force)
    deepest = contact.legs(plant, memory.middle, s, leg, force)

    rigid_body.advance(plant, constant, state, memory.speed, memory.target, h, force, memory.slope)
    total = 0.0
    for i in range(13):
        total += state[i]
    if not math.isfinite(total):
        return NOT_FINITE
    if s[at.ROTATION + 8] < 0.2:
        return UPSET
    if deepest > FLOOR_DEPTH_M:
        return STRUCK
    if abs(state[0]) > 1000.0 or abs(state[1]) > 1000.0 or abs(state[2]) > 100.0:
        return LOST
    return OK


_LOOP = types.Tuple((int64, int64))(
    from_dtype(DTYPE)[::1], float64[:, ::1], int64[::1], float64[:, ::1], float64[:, ::1], float64[::1],
    float64[:, ::1], types.UniTuple(WrenchFunction, SLOTS), int64, float64[:, ::1],
    uint64[:, ::1], uint64[:, ::1], from_dtype(kept.MEMORY_DTYPE)[::1], float64[:, ::1])


@jit(_LOOP, nogil=True)
def fly(plant_array, corners, first, surface, box, room, setpoints, effects, used, parameters,
        effect_streams, streams, memory_array, table):
    """Fly as many rows as `table` (rows, 33) has, the columns of the flight log.

    plant_array (1,); corners, first, surface, box: a World; room (4,): walls for the
    Multi-ranger; setpoints (rows, 8): one a logged row; effects: SLOTS wrenches, `used` of
    them on, with parameters (SLOTS, 8) and streams (SLOTS, 1). memory_array (1,): as
    `kept.begin` leaves it; the next call with it (and the same plant and streams) continues,
    and many short calls give the same numbers as one long one. Returns how it ended (OK or a
    reason) and the number of rows of this call that are filled.
    """
    plant, memory = plant_array[0], memory_array[0]
    ground = (corners, first, surface, box)
    h = plant.step
    hover = math.sqrt(plant.mass * plant.gravity / 4.0 / plant.thrust_per_speed2)
    constant = rigid_body.constants(plant, h)
    noise, ahead = _noise(plant, h), int(plant.controller_ahead / h + 1e-6) % LOG_STEPS
    state = memory.state[:]
    rows = table.shape[0]
    begun = memory.step
    for n in range(rows * LOG_STEPS):
        k = begun + n
        row = n // LOG_STEPS
        imu.sense(plant, memory, streams[1], hover, k)
        if k % WALLS_STEPS == 0:
            ranging.walls(memory, room, state)
        volts = battery.supply(plant, memory.volts)
        for tick in range(max(2 * k - 1, 0), 2 * k + 1):
            imu.sample(plant, memory, tick)
            ranging.range_reading(plant, memory, ground, tick, state, k * h, streams[2], memory.reading)
            ranging.flow_reading(plant, memory, tick, state, k * h, streams[2], memory.reading)
            autopilot.estimate(plant, memory, tick, volts)
        autopilot.steer(plant, memory, setpoints[row], 2 * (k + ahead))
        if n % LOG_STEPS == 0:
            _log(plant, memory, k * h, volts, table[row])
        ending = move(plant, memory, ground, effects, used, parameters, effect_streams, constant, noise, k, hover,
                      volts, streams[0])
        if ending != OK:
            return ending, row + (ending != NOT_FINITE)
    memory.step = begun + rows * LOG_STEPS
    return OK, rows
