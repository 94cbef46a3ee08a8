"""One Crazyflie through cflib: connection, log blocks, parameters, commands, answers. Thin on purpose."""

import contextlib
import queue
import struct
import threading
import time
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from airtouch.crazyflie.autopilot import CODES, Command
from airtouch.crazyflie.blocks import Block
from airtouch.crazyflie.checks import representable
from airtouch.crazyflie.link import connect, disconnect
from airtouch.errors import AirTouchError

CONNECT_S = 20.0
BLOCK_S = 1.5  #: that a log block gets until its first packet
BLOCK_ATTEMPTS = 6  #: a lost "create" makes the "append" after it fail
TAKEN_S = 0.1  #: that an app gets to put a parameter right
ECHO_CHANNEL, LINKCTRL = 0, 15
KINDS = {code: kind for kind, code in CODES.items()} | {4: "go"}
LOG_PORT, SETTINGS_CHANNEL, DATA_CHANNEL = 5, 1, 2
DELETE_BLOCK, CREATE_BLOCK, LOG_HEADER = 2, 6, 4  #: bytes before the values: number, 24-bit clock
INCOMPLETE = 256  #: no error of the firmware: an "append" that came before its "create" is lost
FORGET_S = 0.3
LOG_COMMANDS = {0: "create", 1: "append to", 3: "start", 6: "create", 7: "append to"}
LOG_ERRORS = {2: "a variable or the block is unknown to it", 7: "it is larger than a packet",
              8: "it does not know the command", 12: "its memory for log blocks is full; restart the drone",
              17: "another block has its number", INCOMPLETE: "it left variables out"}


@dataclass(frozen=True)
class Sample:
    """One log packet: its block, the drone's 24-bit clock (ms), arrival (host, s) and values."""

    block: str
    stamp: int
    arrival_s: float
    values: dict[str, float]


class Drone:
    """A connected drone. `samples` and `answers` fill up from cflib's thread; all else is called from ours.

    Raises AirTouchError for a URI that nobody answers at.
    """

    def __init__(self, uri: str, cache: Path | None = None, patience_s: float = CONNECT_S) -> None:
        self.uri, self.cache = uri, cache
        self.samples: queue.SimpleQueue[Sample] = queue.SimpleQueue()
        self.answers: queue.SimpleQueue[tuple[str, int]] = queue.SimpleQueue()
        self._console, self._text = queue.SimpleQueue(), ""
        self.blocks: list[Block] = []
        self.lost = threading.Event()
        self.round_trip_s = float("nan")
        self._refusals: queue.SimpleQueue[tuple[int, int]] = queue.SimpleQueue()
        self._asked: dict[str, tuple[Block, Any]] = {}  #: name -> block and cflib's view of it
        self._forgot_s: dict[int, float] = {}
        self._reviving: threading.Thread | None = None
        self._cf: Any = None
        self._listen(connect(uri, cache, patience_s, self._console.put))

    # connection

    def _listen(self, cf: Any) -> None:
        self._cf = cf
        self.lost.clear()
        cf.connection_lost.add_callback(lambda *_: self.lost.set())
        cf.add_port_callback(8, self._on_answer)
        cf.add_header_callback(self._on_log_setting, LOG_PORT, SETTINGS_CHANNEL)
        cf.add_header_callback(self._on_log_data, LOG_PORT, DATA_CHANNEL)
        cf.link_statistics.stop()  # its thread would wait for itself where the link breaks under it
        cf.add_header_callback(self._on_echo, LINKCTRL, ECHO_CHANNEL)

    def reopen(self, patience_s: float) -> None:
        """Connect anew after the link died, with the same log blocks.

        Raises AirTouchError if it stays dead.
        """
        disconnect(self._cf)
        self._listen(connect(self.uri, self.cache, patience_s, self._console.put))
        for block in self.blocks:
            self.start(block)

    def close(self) -> None:
        """Close the link. The drone must be on the ground."""
        disconnect(self._cf)

    # what it is and has

    @property
    def variables(self) -> set[str]:
        """Names of its log variables."""
        return {f"{group}.{name}" for group, names in self._cf.log.toc.toc.items() for name in names}

    def has_parameter(self, name: str) -> bool:
        """Whether the firmware knows the parameter."""
        return self._cf.param.toc.get_element(*name.split(".", 1)) is not None

    def parameter(self, name: str, patience_s: float = 10.0) -> float | None:
        """A parameter's value, None where the firmware has none of that name or it never came."""
        if not self.has_parameter(name):
            return None
        group, short = name.split(".", 1)
        deadline = time.monotonic() + patience_s
        while time.monotonic() < deadline:
            value = self._cf.param.values.get(group, {}).get(short)
            if value is not None:
                return float(value)
            time.sleep(0.02)
        return None

    def set_parameter(self, name: str, text: str, patience_s: float = 10.0) -> None:
        """Set a parameter and see that the drone took it. Raises AirTouchError where it did not or cannot."""
        element = self._cf.param.toc.get_element(*name.split(".", 1))
        if element is None:
            raise AirTouchError(f"{name}: this firmware has no such parameter")
        if element.get_readable_access() == "RO":
            raise AirTouchError(f"{name}: this parameter is read-only")
        wanted = representable(name, text, element.ctype)
        if self.parameter(name, patience_s) is None:
            raise AirTouchError(f"{name}: the drone does not tell its value; is the link good?")
        echoed, told = threading.Event(), []

        def seen(_: str, value: str) -> None:
            told.append(float(value))
            echoed.set()

        group, short = name.split(".", 1)
        self._cf.param.add_update_callback(group, short, seen)
        try:
            deadline = time.monotonic() + patience_s
            while not self._cf.param.is_updated and time.monotonic() < deadline:
                time.sleep(0.02)
            self._cf.param.set_value(name, wanted)
            echoed.wait(patience_s)
            time.sleep(TAKEN_S)
            self._cf.param.request_param_update(name)  # what it says it was given is not what it keeps
            count = len(told)
            while len(told) <= count and time.monotonic() < deadline:
                time.sleep(0.02)
        finally:
            self._cf.param.remove_update_callback(group, short, seen)
        if not told:
            raise AirTouchError(f"{name}: the drone did not answer; is the link good?")
        if abs(told[-1] - wanted) > 1e-6 * max(abs(wanted), 1.0):
            raise AirTouchError(f"{name} = {text}: out of range; the drone kept {told[-1]:g}")

    @property
    def protocol(self) -> int:
        """Version of its radio protocol."""
        return int(self._cf.platform.get_protocol_version())

    # log blocks

    def start(self, block: Block) -> None:
        """Have a block logged into `samples`.

        Raises AirTouchError that says what the drone has against it.
        """
        reason = f"log block {block.name}: the drone sends none of it; is the link good?"
        for _ in range(BLOCK_ATTEMPTS):
            drain(self._refusals)
            came = self._configure(block)
            until = time.monotonic() + BLOCK_S
            while not came.wait(0.02) and time.monotonic() < until:
                if not self._refusals.empty():
                    command, code = self._refusals.get()
                    reason = (f"log block {block.name} rejected: the drone could not "
                              f"{LOG_COMMANDS[command]} it: {LOG_ERRORS.get(code, f'error {code}')}")
                    break
            if came.is_set():
                if block not in self.blocks:
                    self.blocks.append(block)
                return
        raise AirTouchError(reason)

    def _configure(self, block: Block) -> threading.Event:
        """Ask for the block under a new number; the event is set by its first packet.

        An older one is given up.
        """
        from cflib.crazyflie.log import LogConfig

        config, came = LogConfig(block.name, block.period_ms), threading.Event()
        for name, kind in block.variables:
            config.add_variable(name, kind)

        def take(stamp: int, values: dict[str, float], _: Any) -> None:
            if self._asked.get(block.name, (None, None))[1] is not config:
                return
            came.set()
            self.samples.put(Sample(block.name, stamp, time.monotonic(), values))

        config.data_received_cb.add_callback(take)
        try:
            self._cf.log.add_config(config)
            self._asked[block.name] = block, config
            config.start()
        except (KeyError, AttributeError) as error:
            raise AirTouchError(f"log block {block.name}: {str(error).strip(chr(39))}") from None
        return came

    def revive(self) -> None:
        """Ask for the log blocks again, in the background: with the link down the firmware forgets them."""
        if self._reviving is None or not self._reviving.is_alive():
            self._reviving = threading.Thread(target=self._revive, daemon=True)
            self._reviving.start()

    def _revive(self) -> None:
        for block in list(self.blocks):
            with contextlib.suppress(AirTouchError):
                self.start(block)

    def _on_log_data(self, packet: Any) -> None:
        """Sees to blocks that are none of ours any more, or only half of one."""
        number, size = packet.data[0], len(packet.data) - LOG_HEADER
        wanted = {config.id: block.size for block, config in list(self._asked.values())}
        if number in wanted and size < wanted[number]:
            self._refusals.put((CREATE_BLOCK, INCOMPLETE))
        elif number not in wanted and time.monotonic() - self._forgot_s.get(number, 0.0) > FORGET_S:
            from cflib.crtp.crtpstack import CRTPPacket

            self._forgot_s[number] = time.monotonic()
            delete = CRTPPacket()
            delete.set_header(LOG_PORT, SETTINGS_CHANNEL)
            delete.data = (DELETE_BLOCK, number)
            self._cf.send_packet(delete)

    def _on_log_setting(self, packet: Any) -> None:
        if len(packet.data) >= 3 and packet.data[0] in LOG_COMMANDS and packet.data[2] not in (0, 17):
            self._refusals.put((packet.data[0], packet.data[2]))

    # commands

    def ping(self) -> None:
        """Ask for an echo; `round_trip_s` is what the last one took."""
        if not self.lost.is_set():
            self._cf.link_statistics.latency.ping()

    def said(self) -> list[str]:
        """Whole lines that its console printed since the last call."""
        *lines, self._text = (self._text + "".join(drain(self._console))).split("\n")
        return [line.strip() for line in lines if line.strip()]

    def _on_echo(self, packet: Any) -> None:
        if len(packet.data) == 9:
            self.round_trip_s = time.time() - struct.unpack("<Bd", packet.data)[1]

    def send(self, commands: Iterable[Command]) -> None:
        """Send commands to the high-level commander; answers come in `answers`.

        Nothing is sent on a dead link.
        """
        if self.lost.is_set():
            return
        high = self._cf.high_level_commander
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
        """Ask to be armed, as brushless drones need; others are armed by themselves."""
        self._cf.supervisor.send_arming_request(True)

    def _on_answer(self, packet: Any) -> None:
        if len(packet.data) >= 4 and packet.data[0] in KINDS:
            self.answers.put((KINDS[packet.data[0]], packet.data[3]))


def drain(source: "queue.SimpleQueue[Any]") -> list[Any]:
    """Everything that is in a queue now."""
    found = []
    while True:
        try:
            found.append(source.get_nowait())
        except queue.Empty:
            return found
