"""Flights of RotorPy's Crazyflie under a control loop that is not the firmware's, each with one effect.

Body and the laws of motor lag and drag are RotorPy's (Folk, Paulos and Kumar 2023, arXiv:2306.04485). The loop, the
sensors and the other effects are added here. Frames: x forward, y left, z up; rotors in the log's order m1 front right,
m2 rear right, m3 rear left, m4 front left, unless said otherwise.
"""
