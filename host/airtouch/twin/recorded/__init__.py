"""Recorded flights: read, their course worked out from the log alone, their features."""
