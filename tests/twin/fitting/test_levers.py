"""What a fit may change: within what the effects allow, and what logs of a real Crazyflie need."""

from dataclasses import fields

import numpy as np
import pytest

from airtouch.simulation import effects
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
        trims = np.sum([np.array(levers.ROTOR_SIGNS[x.key]) * getattr(x, end) for x in defaults if x.of == "trim"], 0)
        assert [rotor["thrust_loss"] for rotor in effect_table["weak_motor"]] == pytest.approx(list(-trims), abs=1e-6)
