"""Passing effects: in which seconds each acts, searched for in the flight or known from another vehicle's log.

The words of this room:

- **gate**: the seconds of the flights in which an effect acts, a tuple of intervals (`effects.effect.Gate`). A named
  effect has them as `seconds`.
- **interval**: one of these: (flight, from_s, to_s), or first and last block or piece.
- **burst**: an interval in which a signal is far stronger than in the rest of the flight, whatever shakes it.
- **push**: an interval in which the force along the thrust is at least half of the flight's strongest.
- **piece**: the fraction of a second whose power tells a burst. A **block**, of which one spectrum is taken, is longer.

Which file does what:

- `gates.passing_effects` fits each effect that may pass within the gate that `gate_search` finds, made of the blocks
  that the effect explains best, and within those of `bursts`, which are shorter than a block. The choice of a gate has
  a cost. `naming.passing_effect` calls it for the flights that are diagnosed, `nominal.apparent` for nominal ones.
- `unsteadiness` measures how much stronger torque and lift are in some seconds than in others, and `one_sided` whether
  pushes point down, as in a wake. The same two callers use them.
- `overhead` finds the seconds in which another vehicle was overhead, from its log, and compares them with the rest of
  that flight. `diagnosis` calls it.
"""
