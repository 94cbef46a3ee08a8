"""Robust statistics: what every layer may use."""

#: standard deviation of a normal variable over the median of its absolute deviations: 1 / Phi^-1(3/4), rounded
MAD_TO_SIGMA = 1.4826
