"""The streaming network of the `best` detector: shape, training, quantisation, model file."""
