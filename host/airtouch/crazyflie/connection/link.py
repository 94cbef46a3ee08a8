"""Connecting to a Crazyflie with cflib, patiently, and leaving it without stopping its motors."""

import logging
import os
import threading
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Any

from airtouch.errors import AirTouchError

#: s of silence that end an attempt to connect: before the third packet, and after it
FIRST_S, NEXT_S, FIRST_PACKETS = 1.5, 4.0, 3


def cflib_or_error() -> Any:
    """The cflib package, with its log messages off. Raises AirTouchError with the remedy if it is not installed."""
    try:
        import cflib.crazyflie
        import cflib.crtp
    except ImportError:
        raise AirTouchError("flying needs cflib: pip install 'airtouch[fly]'") from None
    logger = logging.getLogger("cflib")
    if not logger.handlers:
        logger.addHandler(logging.NullHandler())
        logger.propagate = False
    if not cflib.crtp.CLASSES:
        cflib.crtp.init_drivers()
    return cflib


def _usable(cache: Path | None) -> str | None:
    """The cache folder as text for cflib; None if it cannot be made."""
    try:
        if cache:
            cache.mkdir(parents=True, exist_ok=True)
        return str(cache) if cache else None
    except OSError:
        return None


def default_cache() -> Path:
    """The folder of the cached tables of contents, which make the next connection to a drone fast."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "airtouch" / "drones"


def remedy(uri: str) -> str:
    """What to check when nobody answers at the URI, as a question."""
    if uri.startswith("udp"):
        return "is `airtouch sitl` running and ready?"
    return ("is the drone on, the radio plugged in and the URI right (radio://0/80/2M/E7E7E7E7E7, "
            "udp://127.0.0.1:19850)?")


def connect(uri: str, cache: Path | None, patience_s: float, console: Callable[[str], None],
            unanswered: Callable[[str], None] = lambda reason: None) -> Any:
    """A connected cflib Crazyflie. A drone that keeps sending packets may take longer than `patience_s`.

    console: called with pieces of the console's text, from the first on. unanswered: called with the reason after each
    attempt without an answer, the first about FIRST_S after the call; what it raises ends the attempts.
    Raises AirTouchError if nobody answers.
    """
    cflib_or_error()
    from airtouch.crazyflie.connection.cflib_crazyflie import Crazyflie

    deadline, reason = time.monotonic() + patience_s, "nobody answers there"
    while time.monotonic() < deadline:
        cf = Crazyflie(rw_cache=_usable(cache))
        done, failure, heard_s = threading.Event(), [], deque([time.monotonic()], FIRST_PACKETS)
        cf.connected.add_callback(lambda _, done=done: done.set())
        for failed in (cf.connection_failed, cf.connection_lost):
            failed.add_callback(lambda _, text, f=failure, done=done: (f.append(str(text)), done.set()))
        cf.packet_received.add_callback(lambda _, heard_s=heard_s: heard_s.append(time.monotonic()))
        cf.console.receivedChar.add_callback(console)
        cf.open_link(uri)
        if cf.link and uri.startswith("udp"):
            cf.link.needs_resending = True  # UDP loses packets; cflib assumes that it does not
        while not done.wait(0.05):
            if time.monotonic() - heard_s[-1] > (FIRST_S if len(heard_s) < FIRST_PACKETS else NEXT_S):
                break
        if done.is_set() and not failure:
            return cf
        if failure:
            reason = failure[0].strip().splitlines()[0]
            time.sleep(min(0.5, max(deadline - time.monotonic(), 0.0)))
        disconnect(cf)
        unanswered(reason)
    raise AirTouchError(f"{uri}: no connection: {reason}; {remedy(uri)}")


def disconnect(cf: Any) -> None:
    """Close the link without cflib's zero set-point, which would stop the motors of a flying drone."""
    link, cf.link = cf.link, None
    link.close()
    cf.close_link()
