"""A Crazyflie simulator whose every effect can be switched on, off and up.

`batch.simulate` flies many flights of a scenario, `flight.fly` one; `effects` is the
registry. What the equations are is in host/docs/simulate.md.
"""
