"""One Crazyflie through cflib: connection, log blocks, parameters, commands, answers. Thin on purpose."""

import contextlib
import queue
import struct
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

from airtouch.crazyflie.checks import representable
from airtouch.crazyflie.connection.blocks import Block
from airtouch.crazyflie.connection.commands import CODES, Command
from airtouch.crazyflie.connection.link import connect, disconnect
from airtouch.crazyflie.connection.log_blocks import LogBlocks, Sample
from airtouch.errors import AirTouchError

CONNECT_S = 20.0  #: s to connect, fetching all tables included; assumed
TAKEN_S = 0.1  #: s for the drone to correct a parameter that is out of range
ECHO_CHANNEL, LINKCTRL = 0, 15
KINDS = {code: kind for kind, code in CODES.items()} | {4: "go"}


class Drone:
    """A connected drone. cflib's threads fill `samples` and `answers`; call the methods from one thread.

    unanswered: called with the reason after each attempt to connect without an answer (`link.connect`).
    Raises AirTouchError if nobody answers at the URI.
    """

    def __init__(self, uri: str, cache: Path | None = None, patience_s: float = CONNECT_S,
                 unanswered: Callable[[str], None] = lambda reason: None) -> None:
        self.uri, self.cache = uri, cache
        self.samples: queue.SimpleQueue[Sample] = queue.SimpleQueue()
        self.answers: queue.SimpleQueue[tuple[str, int]] = queue.SimpleQueue()
        self._console, self._text = queue.SimpleQueue(), ""
        self.blocks: list[Block] = []
        self.lost = threading.Event()
        self.round_trip_s = float("nan")
        self._log = LogBlocks(self.samples)
        self._reviving: threading.Thread | None = None
        self.crazyflie: Any = None  #: cflib's, while there is a link
        self._listen(connect(uri, cache, patience_s, self._console.put, unanswered))

    # connection

    def _listen(self, cf: Any) -> None:
        self.crazyflie = cf
        self.lost.clear()
        cf.connection_lost.add_callback(lambda *_: self.lost.set())
        cf.add_port_callback(8, self._on_answer)
        self._log.attach(cf)
        cf.link_statistics.stop()  # its thread would join itself when the link breaks
        cf.add_header_callback(self._on_echo, LINKCTRL, ECHO_CHANNEL)

    def reopen(self, patience_s: float) -> None:
        """Connect again after the link was lost, with the same log blocks.

        Raises AirTouchError if nobody answers for `patience_s`.
        """
        disconnect(self.crazyflie)
        self._listen(connect(self.uri, self.cache, patience_s, self._console.put))
        for block in self.blocks:
            self.start(block)

    def close(self) -> None:
        """Close the link. The drone must be on the ground."""
        disconnect(self.crazyflie)

    # variables and parameters

    @property
    def variables(self) -> set[str]:
        """Names of its log variables."""
        return {f"{group}.{name}" for group, names in self.crazyflie.log.toc.toc.items() for name in names}

    def has_parameter(self, name: str) -> bool:
        """True if the firmware has the parameter."""
        return self.crazyflie.param.toc.get_element(*name.split(".", 1)) is not None

    def parameter(self, name: str, patience_s: float = 10.0) -> float | None:
        """A parameter's value; None if the firmware does not have it, or it does not arrive for `patience_s`."""
        if not self.has_parameter(name):
            return None
        group, short = name.split(".", 1)
        deadline = time.monotonic() + patience_s
        while time.monotonic() < deadline:
            value = self.crazyflie.param.values.get(group, {}).get(short)
            if value is not None:
                return float(value)
            time.sleep(0.02)
        return None

    def set_parameter(self, name: str, text: str, patience_s: float = 10.0) -> None:
        """Set a parameter and read it back. Raises AirTouchError if the drone does not have it or keep the value."""
        value = representable(name, text, self._writable(name).ctype)
        deadline = time.monotonic() + patience_s
        with self._updates(name) as updates:
            self._write(name, value, updates, deadline)
            time.sleep(TAKEN_S)  # the first answer repeats the request; the app may still change the value
            stored = _next(updates, deadline, lambda: self.crazyflie.param.request_param_update(name))
        if stored is None:
            raise AirTouchError(f"{name}: the drone did not answer; is the link good?")
        if not abs(stored - value) <= 1e-6 * max(abs(value), 1.0):  # NaN is not the value either
            raise AirTouchError(f"{name} = {text}: out of range; the drone kept {stored:g}")

    def trigger(self, name: str, patience_s: float = 10.0) -> None:
        """Write 1 to a parameter that starts something; the firmware clears it itself, so it is not read back.

        Raises AirTouchError if the drone does not have it or does not answer.
        """
        self._writable(name)
        with self._updates(name) as updates:
            self._write(name, 1, updates, time.monotonic() + patience_s)

    def _writable(self, name: str) -> Any:
        """cflib's entry of a parameter. Raises AirTouchError if the drone does not have it or only reads it."""
        element = self.crazyflie.param.toc.get_element(*name.split(".", 1))
        if element is None:
            raise AirTouchError(f"{name}: this firmware has no such parameter")
        if element.get_readable_access() == "RO":
            raise AirTouchError(f"{name}: this parameter is read-only")
        return element

    @contextlib.contextmanager
    def _updates(self, name: str) -> Iterator[list[float]]:
        """The values of a parameter that arrive meanwhile, in a list that grows."""
        updates: list[float] = []

        def update(_: str, text: str) -> None:
            updates.append(float(text))

        group, short = name.split(".", 1)
        self.crazyflie.param.add_update_callback(group, short, update)
        try:
            yield updates
        finally:
            self.crazyflie.param.remove_update_callback(group, short, update)

    def _write(self, name: str, value: float, updates: list[float], deadline: float) -> None:
        """Write a parameter and wait for the answer. Raises AirTouchError without one."""
        if self.parameter(name, deadline - time.monotonic()) is None:
            raise AirTouchError(f"{name}: the drone does not tell its value; is the link good?")
        while not self.crazyflie.param.is_updated and time.monotonic() < deadline:
            time.sleep(0.02)
        if _next(updates, deadline, lambda: self.crazyflie.param.set_value(name, value)) is None:
            raise AirTouchError(f"{name}: the drone did not answer; is the link good?")

    @property
    def protocol(self) -> int:
        """Version of the drone's CRTP protocol."""
        return int(self.crazyflie.platform.get_protocol_version())

    # log blocks

    def start(self, block: Block) -> None:
        """Start a log block; its packets go to `samples`. Raises AirTouchError with the reason of a refusal."""
        self._log.start(block)
        if block not in self.blocks:
            self.blocks.append(block)

    def revive(self) -> None:
        """Request the log blocks again, in a thread: the firmware deletes them when the link is down."""
        if not self.reviving:
            self._reviving = threading.Thread(target=self._revive, name="airtouch-revive", daemon=True)
            self._reviving.start()

    @property
    def reviving(self) -> bool:
        """Whether the log blocks are being requested again."""
        return self._reviving is not None and self._reviving.is_alive()

    def _revive(self) -> None:
        for block in list(self.blocks):
            with contextlib.suppress(AirTouchError):
                self.start(block)

    # commands

    def ping(self) -> None:
        """Request an echo. `round_trip_s` is the time that the last echo took."""
        if not self.lost.is_set():
            self.crazyflie.link_statistics.latency.ping()

    def console_lines(self) -> list[str]:
        """The complete lines of its console since the last call."""
        *lines, self._text = (self._text + "".join(drain(self._console))).split("\n")
        return [line.strip() for line in lines if line.strip()]

    def _on_echo(self, packet: Any) -> None:
        if len(packet.data) == 9:
            self.round_trip_s = time.time() - struct.unpack("<Bd", packet.data)[1]

    def send(self, commands: Iterable[Command]) -> None:
        """Send commands to the high-level commander; the answers go to `answers`. Without a link nothing is sent."""
        if self.lost.is_set():
            return
        high = self.crazyflie.high_level_commander
        for c in commands:
            if c.kind == "take-off":
                high.takeoff(c.z_m, c.seconds, yaw=c.yaw_rad)
            elif c.kind == "land":
                high.land(c.z_m, c.seconds, yaw=None)
            elif c.kind == "go":
                high.go_to(c.x_m, c.y_m, c.z_m, c.yaw_rad, c.seconds, linear=self.protocol >= 8)
            else:
                high.stop()

    def arm(self) -> None:
        """Request arming. Brushless drones need it; others arm themselves."""
        self.crazyflie.supervisor.send_arming_request(True)

    def _on_answer(self, packet: Any) -> None:
        if len(packet.data) >= 4 and packet.data[0] in KINDS:
            self.answers.put((KINDS[packet.data[0]], packet.data[3]))


def _next(updates: list[float], deadline: float, request: Callable[[], None]) -> float | None:
    """The first value that another thread appends to `updates` after `request`; None after the deadline."""
    count = len(updates)
    request()
    while len(updates) == count and time.monotonic() < deadline:
        time.sleep(0.02)
    return updates[count] if len(updates) > count else None


def drain(source: "queue.SimpleQueue[Any]") -> list[Any]:
    """All items that are in a queue now."""
    items = []
    while True:
        try:
            items.append(source.get_nowait())
        except queue.Empty:
            return items
