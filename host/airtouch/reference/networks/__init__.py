"""The int8 networks, defined in NumPy: over a window, and over the samples of a stream."""
