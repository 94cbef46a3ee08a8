"""The fit: levers, rounds of simulated flights, and the levers that act at edges."""
