"""What the baseline flights say: the vehicle, the floors, how strong each effect seems in them."""
