"""Simulated flights whose IMU shakes or hisses, without what would tell how the rotors turn."""

from dataclasses import replace

from airtouch import vehicle as vehicles
from airtouch.gap.flights import flight
from airtouch.simulation.batch import flights as simulated

VEHICLE = vehicles.load()
FASTER = replace(VEHICLE, thrust_per_speed2=1.9e-8)  #: its rotors turn faster for their thrust than those of VEHICLE
#: rotors that turn at speeds of their own, as real ones do: else their lines add up as their phases happen to stand
APART = [("weak_motor", {"rotor": i, "thrust_loss": 0.01 * i}) for i in (1, 2, 3)]
HIDDEN = ("vbat_V", "rpm_1", "rpm_2", "rpm_3", "rpm_4")


def fly(count, effects=(), seed=0, vehicle=VEHICLE):
    """Flights of a vehicle with effects, ready to be held against the declared one."""
    logs = simulated("diagnosis", count, vehicle=vehicle, effects=effects, seed=seed, workers=1)
    return [flight.ready(replace(log, columns={k: v for k, v in log.columns.items() if k not in HIDDEN}), VEHICLE)
            for log in logs]
