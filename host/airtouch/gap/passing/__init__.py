"""Passing effects: when each acts, found in the flight or known from another vehicle's log.

- `gates.passing_effects` fits each such effect in the `stretches` of blocks that it explains best and in `bursts`,
  which are shorter than a block, and charges the choice. `naming.passing_effect` calls it for the flights that are
  diagnosed, `nominal.apparent` for nominal ones.
- `unsteadiness` measures how much stronger torque and lift are in some seconds than in others, and `one_sided` whether
  pushes point down, as in a wake. The same two callers use them.
- `overhead` finds the seconds in which another vehicle was overhead, from its log, and compares them with the rest of
  that flight. `diagnosis` calls it.
"""
