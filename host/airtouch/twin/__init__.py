"""A simulator fitted to one drone: what its logs show, flown again and matched."""
