"""Flying and watching a real (or virtual) Crazyflie: missions, log blocks, recording, live view.

Only `connection/drone.py`, `connection/link.py`, `connection/log_blocks.py`, `connection/cflib_crazyflie.py` and
`guard.py` talk to cflib. The rest is plain functions and small state machines that need no drone.
"""
