"""Data sets of recorded flights: labels, which flight is held against which, figures of their diagnoses."""
