"""Commands that train, export and compare detectors, and fit the simulator."""
