"""A downward camera beside AirTouch: rendered frames, edges in them, crossings, and both together."""
