"""Effects of sensors, estimator and controller."""
