"""What the detectors have in common; nothing here knows one of them."""
