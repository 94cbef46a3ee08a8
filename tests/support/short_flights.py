"""Short simulated sweeps over a platform, for tests that need flights but none in particular."""

from airtouch import vehicle
from airtouch.logs.flight_log import FlightLog
from airtouch.simulation import batch, scenario

SWEEP = """
name = "short-sweep"
[values]
clearance = { low = 0.025, high = 0.035 }
angle = { choice = [-10.0, 0.0, 10.0] }
speed = { low = 0.28, high = 0.35 }
before = { low = 0.8, high = 1.2 }
[[platform]]
shape = "rectangle"
size_m = [0.75, 4.0]
centre_m = ["= before + 0.375 / cos(angle)", 0.0]
angle_deg = "= angle"
top_m = "= 0.8 - clearance"
[mission]
control = "velocity"
[[mission.step]]
do = "wait"
time_s = 0.5
[[mission.step]]
do = "take-off"
height_m = 0.8
[[mission.step]]
do = "hover"
time_s = 2.5
[[mission.step]]
do = "go"
distance_m = "= before + 0.75 / cos(angle) + 0.8"
speed_mps = "= speed"
[[mission.step]]
do = "hover"
time_s = 1.5
[[mission.step]]
do = "land"
[effects]
ground_effect = { strength = 0.65, fade = 0.08, turbulence = 0.6 }
gust = { rms = 0.1 }
motor_noise = { rms = 0.006, time = 0.36 }
battery_sag = {}
"""


def scene() -> scenario.Scenario:
    """The sweep, about 15 s long, with an entry and an exit."""
    return scenario.parse(SWEEP, "short-sweep")


def fly(count: int, seed: int = 2) -> list[FlightLog]:
    """`count` of them; compiles the simulator first where no cache of it is warm."""
    return batch.simulate(scene(), vehicle.load(), seeds=count, seed=seed)
