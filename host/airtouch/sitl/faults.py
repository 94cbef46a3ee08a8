"""Injected faults of the virtual drone.

    loss=0.3         fraction lost, both ways, of packets without an answer: log data, console, set-points,
                     pings (over a radio the other packets are acknowledged and sent again)
    loss=0.3,all     fraction lost of all packets
    late=50ms        packets are delayed by up to this, in order, both ways
    disconnect=T,5s  no packet passes for 5 s
    gap8-reset=T     the GAP8 restarts
    gap8-silent=T    the GAP8 never answers again
    low-battery=T    the battery is nearly empty

T is in seconds after take-off (`3` or `3s`), or `start`. Only with the parameter `airtouch.detector` at 2, 3 or 4
does the app use the GAP8.
"""

import heapq
import itertools
import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from airtouch.errors import AirTouchError, unknown
from airtouch.sitl.services import packet as crtp
from airtouch.sitl.services.packet import Packet, Peer

KINDS = {"loss": "a share, as loss=0.3", "late": "a time, as late=50ms",
         "disconnect": "when and how long, as disconnect=3,5s", "gap8-reset": "when, as gap8-reset=3",
         "gap8-silent": "when, as gap8-silent=3",
         "low-battery": "when, as low-battery=3"}
ALL = "all"
LINE = ("loss", "late")  #: kinds of faults of the link


@dataclass(frozen=True)
class Fault:
    """A fault of one of KINDS. at_s: s after take-off, minus infinity for the start. amount: fraction or seconds."""

    kind: str
    at_s: float = -math.inf
    amount: float = 0.0
    all_packets: bool = False


def parse(text: str) -> Fault:
    """The fault in a text as on the command line. Raises AirTouchError with the right form."""
    kind, _, value = text.partition("=")
    if kind not in KINDS:
        raise unknown("fault", kind, KINDS)
    parts = value.split(",")
    try:
        if kind == "loss":
            share = float(parts[0])
            if not 0.0 <= share < 1.0 or parts[1:] not in ([], [ALL]):
                raise ValueError
            return Fault(kind, amount=share, all_packets=len(parts) > 1)
        if kind == "late" and len(parts) == 1:
            return Fault(kind, amount=seconds(parts[0]))
        if len(parts) == (2 if kind == "disconnect" else 1):
            at = -math.inf if parts[0] == "start" else seconds(parts[0])
            return Fault(kind, at, seconds(parts[1]) if kind == "disconnect" else 0.0)
    except ValueError:
        pass
    raise AirTouchError(f"fault {text}: needs {KINDS[kind]}")


def seconds(text: str) -> float:
    """Seconds in a text such as `3`, `3s` or `50ms`. Raises ValueError for another form and for negative values."""
    scale = 1e-3 if text.endswith("ms") else 1.0
    value = scale * float(text.removesuffix("ms").removesuffix("s"))
    if not 0.0 <= value < 1e6:
        raise ValueError(text)
    return value


def is_unacknowledged(packet: Packet) -> bool:
    """True for a packet that is neither answered nor acknowledged."""
    return (packet.port in (crtp.CONSOLE, crtp.COMMANDER, crtp.GENERIC, crtp.LOCALIZATION)
            or packet.port == crtp.LOG and packet.channel == 2
            or packet.port == crtp.LINK and packet.channel == 0)


class Line:
    """One direction of the link. `put` sends a packet; `ready` returns those that have arrived.

    Times are those of the drone, in s.
    """

    def __init__(self, faults: Iterable[Fault], rng: np.random.Generator) -> None:
        self._loss: list[Fault] = []
        self._late = 0.0
        for fault in faults:
            self.add(fault)
        self._rng = rng
        self._waiting: list[tuple[float, int, Packet, Peer]] = []
        self._count, self._last = itertools.count(), 0.0
        self.lost = 0

    def add(self, fault: Fault) -> None:
        """Add a fault. Faults that do not concern the link are ignored."""
        if fault.kind == "loss":
            self._loss.append(fault)
        elif fault.kind == "late":
            self._late = max(self._late, fault.amount)

    def put(self, packet: Packet, peer: Peer, now_s: float) -> None:
        """Send a packet to or from `peer`."""
        if any(self._rng.random() < f.amount for f in self._loss if f.all_packets or is_unacknowledged(packet)):
            self.lost += 1
            return
        due = now_s
        if self._late > 0.0:
            due = max(self._last, now_s + self._late * self._rng.random())
            self._last = due
        heapq.heappush(self._waiting, (due, next(self._count), packet, peer))

    def ready(self, now_s: float) -> list[tuple[Packet, Peer]]:
        """The packets that have arrived by now, in order."""
        out = []
        while self._waiting and self._waiting[0][0] <= now_s:
            _, _, packet, peer = heapq.heappop(self._waiting)
            out.append((packet, peer))
        return out

    def clear(self) -> None:
        """Lose all packets that are on their way."""
        self.lost += len(self._waiting)
        self._waiting.clear()
