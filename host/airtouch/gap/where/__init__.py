"""Where the gap lies: the map by channel, band, phase and regime.

The residual of each flight is cut into bands (`filter_bank`) and its squares are summed over short blocks, by regime
(`regimes`, `band_sums`). A cell is the rms over all blocks of a phase with a 90 % interval, and its floor is what
nominal flights scatter by (`cell_tables`). `gap_map` puts the cells together, without and with the named effects in the
model, of which `random_power` gives the power of random ones; `summary` says which stand out, which are listed and
which one stands for the gap, `cell_words` puts one into words. `rotor_speeds` and `command_power` are two more views of
the same flights.
"""
