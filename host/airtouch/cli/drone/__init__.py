"""Commands that need a drone, real or virtual."""
