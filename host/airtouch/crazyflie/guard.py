"""A process of its own that lands the drone when the one that flies it dies without having landed.

The high-level commander would hover until the battery is empty. `python -m airtouch.crazyflie.guard URI
HEIGHT SECONDS` waits on its standard input, whose end means that the flying process is gone: land commands go
out until one is answered. After a landing the flying process ends it.
"""

import contextlib
import signal
import struct
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

PATIENCE_S = 60.0  #: for a drone that is out of reach or a radio that is still busy
RESEND_S = 0.2
HEADER = 0x8C  #: CRTP port 8, channel 0
LAND = 8


def land_packet(height_m: float, seconds: float) -> bytes:
    """COMMAND_LAND_2 of the high-level commander: to this height, heading kept."""
    return struct.pack("<BBff?f", LAND, 0, height_m, 0.0, True, seconds)


@dataclass
class Guard:
    """Set `landed` once nothing flies any more; without it the guard lands."""

    landed: bool = False


@contextlib.contextmanager
def guarding(uri: str, height_m: float, seconds: float) -> Iterator[Guard]:
    """While the body runs, another process stands by to land."""
    command = [sys.executable, "-m", "airtouch.crazyflie.guard", uri, str(height_m), str(seconds)]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, start_new_session=True)
    guard = Guard()
    try:
        yield guard
    finally:
        if guard.landed:
            process.kill()
        if process.stdin is not None:
            process.stdin.close()
        if guard.landed:
            process.wait()


def land(uri: str, height_m: float, seconds: float, patience_s: float = PATIENCE_S) -> bool:
    """Send land until the drone answers; whether it did."""
    from cflib.crtp.crtpstack import CRTPPacket

    from airtouch.crazyflie.link import cflib_or_error

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
        except Exception:  # the radio may still belong to the dying process: any driver error, try again
            link = None
        time.sleep(RESEND_S)
    return False


def _answered(link: Any) -> bool:
    until = time.monotonic() + RESEND_S
    while time.monotonic() < until:
        packet = link.receive_packet(0.05)
        if packet is not None and packet.port == 8 and packet.data[:1] == bytes([LAND]):
            return True
    return False


def main() -> None:
    """Wait for the end of the input; what landing needs is loaded before."""
    from airtouch.crazyflie.link import cflib_or_error

    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    cflib_or_error()
    sys.stdin.read()
    uri, height, seconds = sys.argv[1], float(sys.argv[2]), float(sys.argv[3])
    done = land(uri, height, seconds)
    what = "landing" if done else "NO CONTACT, land by hand"
    print(f"airtouch: the flying process is gone; {what}", file=sys.stderr)


if __name__ == "__main__":
    main()
