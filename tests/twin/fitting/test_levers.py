"""What a fit may change: within what the effects allow, and what logs of a real Crazyflie need."""

from dataclasses import fields

import numpy as np

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
        assert levers.craft(vehicle, defaults, np.array([getattr(x, end) for x in defaults]))
