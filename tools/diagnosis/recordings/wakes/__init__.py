"""Wakes of other vehicles in neural-swarm's flights: what tools/diagnosis/gap_wakes.py prints of them."""
