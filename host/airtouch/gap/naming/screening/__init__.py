"""Every variant judged at a fraction of what its fit would cost, to see which are worth one.

`screen` is asked by each round (`naming.rounds`): it screens mean and random effects, and says which to fit.
`first_order` has a variant's gain by its first-order change of the residual, or by the strength of its random effect.
"""
