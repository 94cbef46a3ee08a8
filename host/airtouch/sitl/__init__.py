"""A virtual Crazyflie: a CRTP server on UDP that runs the simulator and the app's C code.

    with airtouch.sitl.serve("paper-9cm", port=0) as virtual:
        scf = SyncCrazyflie(virtual.uri)
"""

from airtouch.sitl.server import Server, serve

__all__ = ["Server", "serve"]
