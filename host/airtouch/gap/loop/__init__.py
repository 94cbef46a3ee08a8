"""The closed loop: the controller's gains, its transfer functions, what the commands of nominal flights show."""
