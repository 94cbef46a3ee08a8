"""One flight as one compiled loop of stages over one record of named state.

Order within a step of 2 ms: the IMU gives two samples, down range and flow measure when they are due, the firmware's
estimator runs a tick for each millisecond and its controllers one, the log takes its row (100 Hz), the delayed
command reaches the motors, every effect adds its force and torque at the middle of the step, the body moves (RK4).
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numba import float64, from_dtype, int64, types
from numba.core.typing.typeof import typeof_impl

from airtouch.simulation import signals as at
from airtouch.simulation.body import battery, forces, motors, rigid_body
from airtouch.simulation.compiled import inlined, jit
from airtouch.simulation.effects.slots import EFFECT_SLOTS, EffectSlots
from airtouch.simulation.firmware import autopilot
from airtouch.simulation.flight_plan.world import WORLD, World
from airtouch.simulation.plant import PLANT
from airtouch.simulation.sensors import imu, log_row, multi_ranger, ranging
from airtouch.simulation.state import STATE

LOG_STEPS = 5  #: physics steps a logged row
OK, NOT_FINITE, UPSET, STRUCK, LOST = range(5)  #: how a flight ended
ENDINGS = ("ok", "a value is not finite", "it turned over", "it struck a surface", "it flew away")
LEAST_UPRIGHT = 0.2  #: cosine of the tilt below which it has turned over
FLOOR_DEPTH_M = 0.015  #: legs this far inside a surface: it struck it
FAR_M, HIGH_M = 1000.0, 100.0  #: beyond them it flew away
#: random numbers of the motors, the IMU, the other sensors and of the start
GENERATORS = np.dtype([(name, np.uint64, (1,)) for name in ("motors", "imu", "ranging", "start")])


class Flight(NamedTuple):
    """All that one flight needs: what stays as it is, its random numbers, and its state.

    plant (1,): plant.DTYPE; world: World; room (4,): walls for the Multi-ranger; effects: EffectSlots;
    generators (1,): GENERATORS; state (1,): state.DTYPE, as `state.begin` leaves it.
    """

    plant: np.ndarray
    world: World
    room: np.ndarray
    effects: EffectSlots
    generators: np.ndarray
    state: np.ndarray


FLIGHT = types.NamedTuple(
    (PLANT, WORLD, float64[::1], EFFECT_SLOTS, from_dtype(GENERATORS)[::1], STATE), Flight)  #: in compiled code


@typeof_impl.register(Flight)
def _type_of_flight(value: Flight, _context: Any) -> types.NamedTuple:
    """Known beforehand, so that numba need not work it out at each call."""
    return FLIGHT


class Constants(NamedTuple):
    """What follows from the plant alone."""

    hover_speed: float  #: rad/s of a rotor
    lead_steps: int  #: physics steps from the firmware's 100 Hz run to the log's row
    body: rigid_body.Constants
    noise: motors.Noise


@jit
def constants(plant):
    """The Constants of a plant."""
    hover_speed = math.sqrt(plant.mass * plant.gravity / 4.0 / plant.thrust_per_speed2)
    lead_steps = int(plant.controller_ahead / plant.step + 1e-6) % LOG_STEPS
    return Constants(hover_speed, lead_steps, rigid_body.constants(plant), motors.noise(plant))


@inlined
def control(flight, fixed, row, volts):
    """Run sensors and firmware over the two milliseconds that end with this step, for a set-point row (8,).

    The command is in state.motors.pwm; fixed: Constants; volts: what the motors see.
    """
    plant, state, generator = flight.plant[0], flight.state[0], flight.generators[0].ranging[:]
    k, lead = state.step, 2 * fixed.lead_steps
    for tick in range(max(2 * k - 1, 0), 2 * k + 1):
        imu.reading(plant, state, tick)
        ranging.range_reading(plant, state, flight.world, tick, generator)
        ranging.flow_reading(plant, state, tick, generator)
        autopilot.estimate(plant, state, tick + lead, volts)
    autopilot.steer(plant, state, row, 2 * k + lead)


@inlined
def move(flight, fixed, volts):
    """Advance the vehicle by one physics step under state.motors.pwm: motors, effects, body. Returns OK or a reason.

    fixed: Constants; volts: what the motors see.
    """
    plant, state = flight.plant[0], flight.state[0]
    motors.drive(plant, state, fixed.noise, volts, flight.generators[0].motors[:])
    forces.act(plant, state, flight.world, flight.effects, fixed.hover_speed)
    rigid_body.advance(plant, fixed.body, state.body)
    return _ending(state)


@jit
def _ending(state):
    """OK, or the reason why the flight ends here."""
    pose, total = state.body.state, 0.0
    for i in range(rigid_body.STATE_SIZE):
        total += pose[i]
    if not math.isfinite(total):
        return NOT_FINITE
    if state.forces.signals[at.ROTATION + 8] < LEAST_UPRIGHT:
        return UPSET
    if state.forces.deepest > FLOOR_DEPTH_M:
        return STRUCK
    if abs(pose[0]) > FAR_M or abs(pose[1]) > FAR_M or abs(pose[2]) > HIGH_M:
        return LOST
    return OK


@jit(types.Tuple((int64, int64))(FLIGHT, float64[:, ::1], float64[:, ::1]), nogil=True)
def fly(flight, setpoints, table):
    """Fly len(table) rows and fill `table` (rows, 33), the columns of the flight log.

    setpoints (rows, 8): one a logged row. The next call with the same Flight continues, and many short calls give
    the same numbers as one long one. Returns how it ended (OK or a reason) and the number of rows of this call that
    are filled.
    """
    plant, state, generators = flight.plant[0], flight.state[0], flight.generators[0]
    fixed, first_step = constants(plant), state.step
    for n in range(table.shape[0] * LOG_STEPS):
        row = n // LOG_STEPS
        state.step = first_step + n
        state.time_s = state.step * plant.step
        imu.sense(plant, state, fixed.hover_speed, generators.imu[:])
        multi_ranger.read(state, flight.room)
        volts = battery.supply(plant, state.battery.volts)
        control(flight, fixed, setpoints[row], volts)
        if n % LOG_STEPS == 0:
            log_row.write(plant, state, volts, table[row])
        ending = move(flight, fixed, volts)
        if ending != OK:
            return ending, row + (ending != NOT_FINITE)
    state.step = first_step + table.shape[0] * LOG_STEPS
    return OK, table.shape[0]
