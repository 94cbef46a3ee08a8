"""Faults to order: what goes wrong, when, and for how long.

    loss=0.3         this share is lost, both ways, of what nobody waits for: log data, console,
                     set-points, pings (over a radio, acknowledgements bring the rest through)
    loss=0.3,all     of every packet
    late=50ms        packets are up to so late, in order, both ways
    disconnect=T,5s  no packet passes for 5 s
    gap8-reset=T     the GAP8 restarts
    gap8-silent=T    the GAP8 never answers again
    low-battery=T    the battery is nearly empty

T is in seconds after take-off (`3` or `3s`), or `start` for at once. The GAP8 is used, and missed, where the parameter
`airtouch.detector` is 2, 3 or 4.
"""

import heapq
import itertools
import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.sitl import packet as crtp
from airtouch.sitl.packet import Packet, Peer

KINDS = {"loss": "a share, as loss=0.3", "late": "a time, as late=50ms",
         "disconnect": "when and how long, as disconnect=3,5s", "gap8-reset": "when, as gap8-reset=3",
         "gap8-silent": "when, as gap8-silent=3",
         "low-battery": "when, as low-battery=3"}
ALL = "all"
LINE = ("loss", "late")  #: kinds that a line has


@dataclass(frozen=True)
class Fault:
    """One of KINDS. at_s: after take-off, minus infinity for the start. amount: share or seconds."""

    kind: str
    at_s: float = -math.inf
    amount: float = 0.0
    everything: bool = False


def parse(text: str) -> Fault:
    """A fault as it is written on the command line. Raises AirTouchError that names the right form."""
    kind, _, value = text.partition("=")
    if kind not in KINDS:
        raise AirTouchError(f"no fault {kind!r}; known: {', '.join(KINDS)}")
    parts = value.split(",")
    try:
        if kind == "loss":
            share = float(parts[0])
            if not 0.0 <= share < 1.0 or parts[1:] not in ([], [ALL]):
                raise ValueError
            return Fault(kind, amount=share, everything=len(parts) > 1)
        if kind == "late" and len(parts) == 1:
            return Fault(kind, amount=seconds(parts[0]))
        if len(parts) == (2 if kind == "disconnect" else 1):
            at = -math.inf if parts[0] == "start" else seconds(parts[0])
            return Fault(kind, at, seconds(parts[1]) if kind == "disconnect" else 0.0)
    except ValueError:
        pass
    raise AirTouchError(f"fault {text}: needs {KINDS[kind]}")


def seconds(text: str) -> float:
    """`3`, `3s` or `50ms` in seconds, not negative; ValueError for anything else."""
    scale = 1e-3 if text.endswith("ms") else 1.0
    value = scale * float(text.removesuffix("ms").removesuffix("s"))
    if not 0.0 <= value < 1e6:
        raise ValueError(text)
    return value


def is_stream(packet: Packet) -> bool:
    """Whether nobody waits for it."""
    return (packet.port in (crtp.CONSOLE, crtp.COMMANDER, crtp.GENERIC, crtp.LOCALIZATION)
            or packet.port == crtp.LOG and packet.channel == 2
            or packet.port == crtp.LINK and packet.channel == 0)


class Line:
    """One direction of the link: packets go in with `put` and come out of `ready`, or not.

    Times are the drone's, in seconds.
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
        """From now on it has this fault too; those that are not a line's are ignored."""
        if fault.kind == "loss":
            self._loss.append(fault)
        elif fault.kind == "late":
            self._late = max(self._late, fault.amount)

    def put(self, packet: Packet, peer: Peer, now_s: float) -> None:
        """Send a packet to or from `peer`."""
        if any(self._rng.random() < f.amount for f in self._loss if f.everything or is_stream(packet)):
            self.lost += 1
            return
        due = now_s
        if self._late > 0.0:
            due = max(self._last, now_s + self._late * self._rng.random())
            self._last = due
        heapq.heappush(self._waiting, (due, next(self._count), packet, peer))

    def ready(self, now_s: float) -> list[tuple[Packet, Peer]]:
        """What has arrived by now, in order."""
        out = []
        while self._waiting and self._waiting[0][0] <= now_s:
            _, _, packet, peer = heapq.heappop(self._waiting)
            out.append((packet, peer))
        return out

    def clear(self) -> None:
        """Everything that is under way is lost."""
        self.lost += len(self._waiting)
        self._waiting.clear()
