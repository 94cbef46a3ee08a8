"""Flights without a gyro: which rotor is damaged, by the commands of a hover."""
