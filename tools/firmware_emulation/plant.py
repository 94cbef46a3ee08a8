"""The simulator without its firmware: what the emulated board's sensors read, and what its motors do."""

import math

import numpy as np

from airtouch.simulation import loop
from airtouch.simulation.body import battery
from airtouch.simulation.body.rotation import euler
from airtouch.simulation.compiled import jit
from airtouch.simulation.scenario import FlightPlan
from airtouch.simulation.sensors import imu, ranging
from airtouch.simulation.stepper import Stepper
from airtouch.vehicle import Vehicle

STEP_S = 0.002  #: s of a step of the simulator
#: a step's readings: acceleration (m/s^2) and rates (rad/s) of two milliseconds, down range (m, NaN: none), flow counts
#: forward and left, voltage
ACC, GYRO, RANGE, FLOW, VOLTS, READINGS = 0, 6, 12, 13, 15, 16


class Plant:
    """A drawn flight's vehicle, world and effects, flown from outside: `step` takes PWM and gives readings.

    state["body"]["state"] is the truth: position, velocity, attitude (w first), rates.
    """

    def __init__(self, plan: FlightPlan, vehicle: Vehicle, seed: int, flight: int, active: list) -> None:
        self.stepper = s = Stepper(plan, vehicle, seed, flight, active)
        s.plant["firmware"]["filters"]["acc_hz"] = 0.0  # the real firmware has its own
        s.plant["gyro_lowpass"] = 0.0
        # The simulator's flow is that of recorded flights, whose firmware was corrected for the platform: it follows
        # the height over the floor. The sensor itself sees the distance to what is below.
        s.plant["flow_share"] = 1.0
        s.begin(plan.setpoints[0])
        self.state = s.state[0]
        self.readings = np.zeros(READINGS)

    def step(self, pwm: np.ndarray) -> int:
        """Two milliseconds under this PWM (4,): loop.OK or how it ended; `readings` as of their beginning."""
        self.state["motors"]["pwm"] = pwm
        return _step(self.stepper.flight, self.readings)

    @property
    def place(self) -> np.ndarray:
        """Position (3,) of the down range sensor over the floor, m."""
        return self.state["body"]["state"][:3] - [0.0, 0.0, float(self.stepper.plant[0]["range_below_rotors"])]

    @property
    def velocity(self) -> np.ndarray:
        """(3,) m/s, true."""
        return self.state["body"]["state"][3:6]

    @property
    def angles(self) -> tuple[float, float, float]:
        """True roll, pitch and yaw, rad."""
        return euler(self.state["body"]["state"][6:10])

    @property
    def top(self) -> float:
        """Height of the surface that the down range saw last, m."""
        return float(self.state["ranging"]["seen_top"])


@jit(nogil=True)
def _step(flight, out):
    """One physics step of a loop.Flight; readings (READINGS,) of its beginning into out. How it stands."""
    plant, state, generators = flight.plant[0], flight.state[0], flight.generators[0]
    fixed, reading = loop.constants(plant), state.firmware.reading
    imu.sense(plant, state, fixed.hover_speed, generators.imu[:])
    volts = battery.supply(plant, state.battery.volts)
    out[FLOW], out[FLOW + 1] = 0.0, 0.0
    for half in range(2):
        tick = 2 * state.step - 1 + half
        row = tick & (imu.DELAY_ROWS - 1)
        for i in range(3):
            out[ACC + 3 * half + i] = state.imu.delay_line[row, i]
            out[GYRO + 3 * half + i] = state.imu.delay_line[row, 3 + i]
        if tick >= 0:
            ranging.range_reading(plant, state, flight.world, tick, generators.ranging[:])
            ranging.flow_reading(plant, state, tick, generators.ranging[:])
            if not math.isnan(reading.forward):
                out[FLOW] += reading.forward
                out[FLOW + 1] += reading.left
    out[RANGE], out[VOLTS] = state.ranging.down, volts
    ending = loop.move(flight, fixed, volts)
    state.step += 1
    state.time_s = state.step * plant.step
    return ending
