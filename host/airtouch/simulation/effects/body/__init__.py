"""Effects of what the vehicle weighs, how that is spread, and what hangs below it."""
