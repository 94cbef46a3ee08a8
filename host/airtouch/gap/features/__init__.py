"""One flight as some 2,300 numbers, its features: how its signals go together, and their coordinates.

`flight_signals` are the signals, 21 columns: commands, motion, what model and estimator leave open. Of them
`coherence` takes powers and coherences, `moments` means, variances and regressions, `edge_steps` the steps at edges;
each declares its numbers as a table of `feature`. `flight_features` puts them together, `feature_space` makes them
coordinates, in which nominal flights have the covariance 1.
"""
