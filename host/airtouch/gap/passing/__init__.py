"""Passing effects: when each acts, found in the flight or known from another vehicle's log.

`gates.passing_effects` tries each such effect in the `stretches` of blocks that it explains best and in `bursts`, which
are shorter than a block, and charges the choice. `bursts` also says how unsteady the yaw torque is, and `one_sided`
whether pushes point down, as in a wake. `naming.passing_effect` asks all of flights, `nominal.apparent` of nominal
ones. `overhead` takes the seconds of a wake from another vehicle's log, for `diagnose`, and compares them with the rest
of that flight.
"""
