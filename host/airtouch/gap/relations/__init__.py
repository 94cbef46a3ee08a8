"""What a flight's logged signals do to one another, compared with simulated flights of each effect."""
