"""A second process that lands the drone if the flying process dies while the drone is in the air.

Without it the high-level commander would hover until the battery is empty. `airtouch collect` starts it; nobody else
has to. `python -m airtouch.crazyflie.guard URI HEIGHT SECONDS` waits for the end of its standard input, which means
that the flying process is gone. The input is 1 at each take-off and 0 at each landing. Unless its last character is 0,
the guard then sends land commands until one is answered, for a minute at most: a drone that stands must not get one,
its motors would spin. After a normal landing the flying process ends the guard.
"""

import argparse
import contextlib
import signal
import struct
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import IO, Any

PATIENCE_S = 60.0  #: s to wait for a drone out of reach or a radio that is still busy
RESEND_S = 0.2  #: s between two land commands, until one is answered
PORT = 8  #: CRTP port of the high-level commander
HEADER = PORT << 4 | 0x0C  #: of its packets on channel 0
LAND = 8  #: COMMAND_LAND_2


def land_packet(height_m: float, seconds: float) -> bytes:
    """The packet COMMAND_LAND_2 of the high-level commander: land to this height (m) in this time, same heading."""
    return struct.pack("<BBff?f", LAND, 0, height_m, 0.0, True, seconds)


@dataclass
class Guard:
    """State of the guard and the pipe to its process, which lands the drone at our end while `flying` is true."""

    pipe: IO[bytes] | None = None
    flying: bool = False

    def tell(self, flying: bool) -> None:
        """Say whether the drone is in the air: before the take-off command, and after the landing."""
        if flying != self.flying:
            self.flying = flying
            self._write()

    def _write(self) -> None:
        if self.pipe is not None:
            with contextlib.suppress(OSError):  # the guard is gone; the flight goes on
                self.pipe.write(b"1" if self.flying else b"0")
                self.pipe.flush()


@contextlib.contextmanager
def guarding(uri: str, height_m: float, seconds: float) -> Iterator[Guard]:
    """Run a guard process during the body of a `with` statement. It lands nothing before it is told of a take-off."""
    command = [sys.executable, "-m", "airtouch.crazyflie.guard", "--", uri, str(height_m), str(seconds)]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, start_new_session=True)
    guard = Guard(process.stdin)
    try:
        guard._write()
        yield guard
    finally:
        if not guard.flying:
            process.kill()
        if process.stdin is not None:
            with contextlib.suppress(OSError):
                process.stdin.close()
        if not guard.flying:
            process.wait()


def land(uri: str, height_m: float, seconds: float, patience_s: float = PATIENCE_S) -> bool:
    """Send land commands until the drone answers. False if it does not for `patience_s`."""
    from cflib.crtp.crtpstack import CRTPPacket

    from airtouch.crazyflie.connection.link import cflib_or_error

    crtp = cflib_or_error().crtp
    deadline = time.monotonic() + patience_s
    link = None
    while time.monotonic() < deadline:
        try:
            link = link or crtp.get_link_driver(uri, lambda _: None, lambda _: None)
            if link is not None:
                packet = CRTPPacket(HEADER)
                packet.data = land_packet(height_m, seconds)
                link.send_packet(packet)
                if _answered(link):
                    return True
        except Exception:  # any error of the driver: the dying process may still hold the radio
            link = None
        time.sleep(RESEND_S)
    return False


def _answered(link: Any) -> bool:
    until = time.monotonic() + RESEND_S
    while time.monotonic() < until:
        packet = link.receive_packet(0.05)
        if packet is not None and packet.port == PORT and packet.data[:1] == bytes([LAND]):
            return True
    return False


def main() -> None:
    """Wait for the end of standard input, then land. The modules for landing are imported before."""
    parser = argparse.ArgumentParser("python -m airtouch.crazyflie.guard", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter,
                                     epilog="To land a drone by hand, with Ctrl-D at once:\n"
                                            "  python -m airtouch.crazyflie.guard radio://0/80/2M/E7E7E7E7E7 0 3")
    parser.add_argument("uri", help="of the drone: radio://0/80/2M/E7E7E7E7E7, usb://0, udp://127.0.0.1:19850")
    parser.add_argument("height", type=float, help="to land at, m: where it took off")
    parser.add_argument("seconds", type=float, help="that the landing takes, s")
    options = parser.parse_args()
    from airtouch.crazyflie.connection.link import cflib_or_error

    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    cflib_or_error()
    if sys.stdin.buffer.read()[-1:] == b"0":
        return
    done = land(options.uri, options.height, options.seconds)
    what = "landing" if done else "NO CONTACT, land by hand"
    print(f"airtouch: the flying process is gone; {what}", file=sys.stderr)


if __name__ == "__main__":
    main()
