"""Flights to train and test on: under which conditions, held out with which, recorded or simulated."""
