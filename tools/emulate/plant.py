"""The simulator without its firmware: what the emulated board's sensors read, and what its motors do."""

import math

import numpy as np
from numba import njit

from airtouch.simulation import battery, imu, loop, ranging, rigid_body
from airtouch.simulation.scenario import FlightPlan
from airtouch.simulation.stepper import Stepper
from airtouch.vehicle import Vehicle

STEP_S = 0.002
#: a step's readings: acceleration (m/s^2) and rates (rad/s) of two milliseconds, down range (m, NaN: none), flow counts
#: forward and left, voltage
ACC, GYRO, RANGE, FLOW, VOLTS, READINGS = 0, 6, 12, 13, 15, 16


class Plant:
    """A drawn flight's vehicle, world and effects, flown from outside: `step` takes PWM and gives readings.

    memory["state"] is the truth: position, velocity, attitude (w first), rates.
    """

    def __init__(self, plan: FlightPlan, vehicle: Vehicle, seed: int, flight: int, active: list) -> None:
        self._stepper = s = Stepper(plan, vehicle, seed, flight, active)
        s.plant["firmware"]["filters"]["acc_hz"] = 0.0  # the real firmware has its own
        s.plant["gyro_lowpass"] = 0.0
        # The simulator's flow is that of recorded flights, whose firmware was corrected for the platform: it follows
        # the height over the floor. The sensor itself sees the distance to what is below.
        s.plant["flow_share"] = 1.0
        s.begin(plan.setpoints[0])
        self.memory = s.memory[0]
        self.readings = np.zeros(READINGS)

    def step(self, pwm: np.ndarray) -> int:
        """Two milliseconds under this PWM (4,): loop.OK or how it ended; `readings` as of their beginning."""
        s, w = self._stepper, self._stepper.world
        self.memory["pwm"] = pwm
        return _step(s.plant, w.corners, w.first, w.surface, w.box, s.functions, s.used, s.parameters, s.effect_streams,
                     s.streams, s.memory, self.readings)

    @property
    def place(self) -> np.ndarray:
        """Position (3,) of the down range sensor over the floor, m."""
        return self.memory["state"][:3] - [0.0, 0.0, float(self._stepper.plant[0]["range_below_rotors"])]

    @property
    def top(self) -> float:
        """Height of the surface that the down range saw last, m."""
        return float(self.memory["top"])


@njit(nogil=True)
def _step(plant_array, corners, first, surface, box, effects, used, parameters, effect_streams, streams, memory_array,
          out):
    plant, memory = plant_array[0], memory_array[0]
    ground = (corners, first, surface, box)
    h, k = plant.step, memory.step
    hover = math.sqrt(plant.mass * plant.gravity / 4.0 / plant.thrust_per_speed2)
    imu.sense(plant, memory, streams[1], hover, k)
    volts = battery.supply(plant, memory.volts)
    out[FLOW], out[FLOW + 1] = 0.0, 0.0
    for half in range(2):
        tick = 2 * k - 1 + half
        row = tick & (imu.RING - 1)
        for i in range(3):
            out[ACC + 3 * half + i] = memory.imu[row, i]
            out[GYRO + 3 * half + i] = memory.imu[row, 3 + i]
        if tick >= 0:
            ranging.range_reading(plant, memory, ground, tick, memory.state[:], k * h, streams[2], memory.reading)
            ranging.flow_reading(plant, memory, tick, memory.state[:], k * h, streams[2], memory.reading)
            if not math.isnan(memory.reading.forward):
                out[FLOW] += memory.reading.forward
                out[FLOW + 1] += memory.reading.left
    out[RANGE], out[VOLTS] = memory.down, volts
    memory.step = k + 1
    return loop.move(plant, memory, ground, effects, used, parameters, effect_streams, rigid_body.constants(plant, h),
                     loop._noise(plant, h), k, hover, volts, streams[0])
