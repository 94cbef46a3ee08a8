"""Detectors of edges: from a flight log to P(over a platform) and the edges that were crossed.

registry    the detectors by name, and what a detector offers: `fit`, `run`, `load`, `lag_s`, `parameters`
trace       what a detector returns for a flight
paper       the paper's pipeline: band powers, fusion, int8 network, physical filter (sections 4 and 5)
best        this project's detector: twelve motion channels, a causal int8 network that runs on a stream of samples
baseline    the comparison of the paper without a network
evaluation  flights with conditions, folds, scores with intervals, cross-validation, maps; finds detectors by name
ablation    what each part of `paper` and `best` is worth
shared      what both networks use: channels, sensors, pruning, TensorFlow, model files, C sources

A stream is the samples of a flight as they come, one every 10 ms. A streaming network takes one sample at a time and
keeps the past: that of `best` (`reference.networks.stream_int8`). The network of the paper takes whole windows, or
rolls over a stream (`paper.rolling`, the detector `paper-stream`).
"""
