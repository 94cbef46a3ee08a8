"""What no named effect explains: a regression on the flight's own signals, and free powers, of what is left."""
