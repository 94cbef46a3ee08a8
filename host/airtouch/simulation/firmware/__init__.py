"""The firmware's own loop: estimator, controllers, mixer, range module, battery compensation.

Written anew for compiled code from descriptions of crazyflie-firmware's behaviour (which is GPL; none
of its code is here) and held equal, sample by sample, to numbers that the real one prints
(tests/simulation/test_firmware_traces.py). `settings.load` reads what differs from release to release
out of a small file.
"""
