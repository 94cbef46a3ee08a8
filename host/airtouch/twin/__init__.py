"""A twin: the simulator fitted to the recorded flights of one drone."""
