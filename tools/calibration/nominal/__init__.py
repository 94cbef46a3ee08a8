"""Nominal flights held against others: the table that tools/calibration/nominal_scatter.py makes."""
