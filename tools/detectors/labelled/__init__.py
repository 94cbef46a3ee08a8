"""Training with a few labelled flights: what labelled_flights.py scores."""
