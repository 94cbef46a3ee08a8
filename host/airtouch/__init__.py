"""AirTouch: edges below a nano-quadcopter, felt through the air under its rotors."""

__version__ = "0.1.0"
