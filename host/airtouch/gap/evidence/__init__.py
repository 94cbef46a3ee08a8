"""How likely flights are under effects.

`data` holds the spectra of some flights and keeps what is worked out of them. A part of their blocks is `flattened` to
one array of values (`layout`, by `cells` of channel and band), of which the `likelihood` is taken. A `problem` is these
values under hypotheses: what mean effects leave of the gap, and the power that is expected, which random effects
(`random_effects`, `vibration_lines`) and effects of the loop (`torque_power`) change. `fit` finds the parameters: of
mean effects by `gauss_newton` (`slopes`, `least_squares`), of random ones by their strength. `clock` judges what shows
in the log's times alone. `against` is what speaks against effects, whoever measures it.
"""
