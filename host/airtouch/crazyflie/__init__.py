"""Flying and watching a real (or virtual) Crazyflie: missions, log blocks, recording, live view.

What needs no drone is plain functions and small state machines here; only `drone.py` and
`guard.py` talk to cflib.
"""
