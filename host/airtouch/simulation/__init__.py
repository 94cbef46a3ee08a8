"""A Crazyflie simulator whose every effect can be switched on, off and up.

`batch.simulate` flies many flights of a scenario, `flight.fly` one; `loop` is one flight as stages over the record
of `state`. The folders: `flight_plan` (floor, platforms, mission), `body`, `sensors`, `firmware`, `effects` (the
registry, one file an effect), `workers` (batches over processes). The equations stand in host/docs/simulate.md.
"""
