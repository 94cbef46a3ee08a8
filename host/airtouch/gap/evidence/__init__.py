"""How likely flights are under effects.

`data` holds the spectra of some flights and keeps what is worked out of them. A `problem` is a part of their blocks as
one flat array (`layout`, by `cells` of channel and band) with its `likelihood`; effects of the loop also change the
power that is expected there (`torque_power`). `fit` finds the parameters: of mean
effects by `gauss_newton` (`slopes`, `least_squares`), of random ones by the power that they add (`random_effects`,
`vibration_lines`). `clock` judges what shows in the log's times alone. Callers: `naming`, `nominal`, `answer`.
"""
