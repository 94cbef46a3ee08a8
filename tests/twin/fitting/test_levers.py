"""What a fit may change: within what the effects allow, and what logs of a real Crazyflie need."""

from dataclasses import fields
from itertools import product

import numpy as np
import pytest
import tomli_w

from airtouch.simulation import effects, scenario
from airtouch.twin.fitting import levers
from airtouch.vehicle import Vehicle


def test_every_bound_is_one_that_the_simulator_takes(vehicle):
    """A fit may end at a bound, and what it ends at must be a scenario and a vehicle that load."""
    parameters = {(e, p.name): p for e in effects.EFFECTS for p in effects.get(e).parameters}
    defaults = levers.default(vehicle)
    assert len({x.name for x in defaults}) == len(defaults)
    for lever in defaults:
        assert lever.low <= lever.start <= lever.high and lever.step > 0.0
        parameter = parameters.get((lever.of, lever.key))
        if parameter is not None:
            assert parameter.low <= lever.low <= lever.high <= parameter.high, lever.name
        elif lever.of == levers.VEHICLE:
            assert lever.key.partition(".")[0] in {f.name for f in fields(Vehicle)}
    for end in ("low", "high"):
        values = [getattr(x, end) for x in defaults]
        craft, mission = levers.craft(vehicle, defaults, np.array(values)), levers.mission(defaults, values)
        effect_table = levers.table(defaults, values, spread=False)
        for lever, value in zip(defaults, values, strict=True):
            if lever.of == levers.VEHICLE:
                field, _, axis = lever.key.partition(".")
                assert (getattr(craft, field)[int(axis)] if axis else getattr(craft, field)) == value, lever.name
            elif lever.of == levers.MISSION:
                assert mission[lever.key] == value, lever.name
            elif lever.of != "trim":
                assert effect_table[lever.of][lever.key] == pytest.approx(value, abs=1e-6), lever.name


@pytest.mark.parametrize("spread", [False, True])
def test_every_corner_of_the_trims_is_a_scenario_that_loads(vehicle, spread):
    """Roll, pitch and yaw add up on a rotor; a gain beyond what `weak_motor` takes, 0.3, stays at that."""
    defaults = levers.default(vehicle)
    trims = {x.key: x for x in defaults if x.of == "trim"}
    mission = '[[mission.step]]\ndo = "take-off"\nheight_m = 0.4\ntime_s = 1.0\n'
    for corner in product((-0.15, 0.11, 0.15), repeat=3):
        values = [dict(zip(trims, corner, strict=True))[x.key] if x.of == "trim" else x.start for x in defaults]
        table = levers.table(defaults, values, spread=spread)
        scene = scenario.parse(f'name = "corner"\n{mission}' + tomli_w.dumps({"effects": table}), "corner")
        scenario.draw_flight(scene, 1, 0)
        roll, pitch, yaw = (dict(zip(trims, corner, strict=True))[key] for key in ("roll", "pitch", "yaw"))
        gains = [-roll + pitch + yaw, -roll - pitch - yaw, roll - pitch + yaw, roll + pitch - yaw]
        expected = [max(-gain, -0.3) for gain in gains]
        losses = [rotor["thrust_loss"] for rotor in table["weak_motor"]]
        if spread:
            assert all(loss["low"] - 1e-6 <= e <= loss["high"] + 1e-6
                       for loss, e in zip(losses, expected, strict=True))
        else:
            assert losses == pytest.approx(expected, abs=1e-6)
