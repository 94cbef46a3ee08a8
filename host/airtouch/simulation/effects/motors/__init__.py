"""Effects of motors, propellers and battery."""
