"""Where the gap lies: the map by channel, band, phase and regime."""
