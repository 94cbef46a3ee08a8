"""A log made ready: when it flies, how it moves, how hard it is flown."""
