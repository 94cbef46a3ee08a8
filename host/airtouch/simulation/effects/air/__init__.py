"""Effects of the air: on the rotors, on the body, near the ground, under another vehicle."""
