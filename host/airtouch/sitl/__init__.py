"""A virtual Crazyflie: CRTP over UDP in front of the simulator and the app's C core.

    with airtouch.sitl.serve("paper-9cm", port=0) as virtual:
        scf = SyncCrazyflie(virtual.uri)
"""

from airtouch.sitl.server import Server, serve

__all__ = ["Server", "serve"]
