"""Effects that come and go: when each acts, found in the flight or known from another vehicle's log."""
