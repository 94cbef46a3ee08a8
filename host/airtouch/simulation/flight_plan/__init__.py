"""What a scenario asks for: the floor and platforms, the steps of a mission, values that are drawn."""
