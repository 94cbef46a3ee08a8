"""Checks of a log: its clock, its channels, the limits of its values, and the quality report that gathers them."""
