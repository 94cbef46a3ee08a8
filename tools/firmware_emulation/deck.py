"""An AI-deck at the emulated UART2: CPX's framing by turns, a GAP8 with the project's core, and what may go wrong."""

import struct
from dataclasses import dataclass, field

import numpy as np

from airtouch.kernels.app_core import Gap8Core

from .board import Board

START, CLEAR = 0xFF, b"\xff\x00"  #: a frame's first byte; "clear to send"
STM32, GAP8, APP = 1, 4, 5  #: CPX's targets and function
LAST = 1 << 6  #: bit of the route: the packet's last part
#: head of a packet between STM32 and GAP8
ROUTE = struct.pack("<BB", STM32 | GAP8 << 3 | LAST, APP)
HEARTBEAT_STEPS = 50  #: steps of 10 ms from one heartbeat of the GAP8 to the next


@dataclass(frozen=True)
class Faults:
    """What goes wrong on the deck: steps are the app's, fractions are of the packets, both ways.

    there: whether its ESP32 answers at all. dead: (from, to) in which the GAP8 says nothing. reset: the step before
    which it loses power. late: steps by which answers come later. lost, damaged: packets that never come, or with a
    wrong byte. wrong_byte: the step from which CPX's own checksum is wrong.
    """

    there: bool = True
    dead: tuple[int, int] = (0, 0)
    reset: int = -1
    late: int = 0
    lost: float = 0.0
    damaged: float = 0.0
    wrong_byte: int = -1


def frame(packet: bytes) -> bytes:
    """A packet of the GAP8's app as the ESP32 sends it on."""
    body = bytes([START, len(ROUTE) + len(packet)]) + ROUTE + packet
    return body + bytes([np.bitwise_xor.reduce(np.frombuffer(body, np.uint8))])


@dataclass
class Deck:
    """`Deck(board, faults)` answers what the board sends; `turn(step)` is called before each step of the app.

    sent: packets of the app that came over the UART. `step_packets()`: what the last step of the app received.
    """

    board: Board
    faults: Faults = field(default_factory=Faults)
    seed: int = 0
    sent: list[bytes] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._gap8, self._rng = Gap8Core(), np.random.default_rng(self.seed)
        self._bytes, self._clear, self._step = b"", False, 0
        self._due: list[tuple[int, bytes]] = []
        self._arrived: list[bytes] = []
        self._next: list[bytes] = []  # written while the app begins its step, and read after it
        self._begins = False
        self.board.on("U", self._take)

    def turn(self, step: int) -> None:
        """The app is about to begin this step: a heartbeat, a loss of power."""
        self._step = step
        if step == self.faults.reset:
            self._gap8.reset()
        beat = self._gap8.heartbeat(10 * step) if step % HEARTBEAT_STEPS == 0 else b""
        if beat and self._alive():
            self._answer(beat)
        self._begins = True
        self._flush()
        self._begins = False

    def step_packets(self) -> list[bytes]:
        """The packets that the last step received."""
        now, self._arrived, self._next = self._arrived, self._next, []
        return now

    def _alive(self) -> bool:
        """Whether the GAP8 answers in this step."""
        first, last = self.faults.dead
        return not first <= self._step < last

    def _take(self, content: bytes) -> None:
        """Take bytes from the board and handle each whole CPX packet."""
        self._bytes += content
        while (whole := self._take_frame()) is not None:
            if whole == CLEAR:
                self._clear = True
            elif (whole[2] & 7, whole[3] & 63) == (GAP8, APP):  # others are for the ESP32: the WiFi's name and key
                self._packet(whole[2 + len(ROUTE):-1])
            if self.faults.there:
                self.board.say("U", CLEAR)
        if self.faults.there:
            self._flush()
        self.board.go()

    def _take_frame(self) -> bytes | None:
        """The first whole frame of what came, which is taken out."""
        if len(self._bytes) < 2:
            return None
        length = 2 if self._bytes[1] == 0 else 3 + self._bytes[1]
        if len(self._bytes) < length:
            return None
        whole, self._bytes = self._bytes[:length], self._bytes[length:]
        return whole

    def _packet(self, packet: bytes) -> None:
        """Pass a packet to the GAP8, with the faults of the link, and send its reply."""
        self.sent.append(packet)
        came = self._on_the_way(packet)
        reply = self._gap8.take(came) if came and self._alive() else b""
        if reply:
            self._answer(reply)

    def _answer(self, packet: bytes) -> None:
        """Send a reply to the board after the delay of the link, with its faults."""
        came = self._on_the_way(packet)
        if came:
            self._due.append((self._step + self.faults.late, came))

    def _on_the_way(self, packet: bytes) -> bytes:
        """A packet after the link: as it was, with one bit flipped, or empty if it is lost."""
        if self._rng.random() < self.faults.lost:
            return b""
        if self._rng.random() < self.faults.damaged:
            at = self._rng.integers(len(packet))
            return packet[:at] + bytes([packet[at] ^ 1 << self._rng.integers(8)]) + packet[at + 1:]
        return packet

    def _flush(self) -> None:
        """The next answer that is due, where the board is clear to take one."""
        if self._clear and self._due and self._due[0][0] <= self._step:
            packet = self._due.pop(0)[1]
            whole = frame(packet)
            if 0 <= self.faults.wrong_byte <= self._step:
                whole = whole[:-1] + bytes([whole[-1] ^ 1])
            self.board.say("U", whole)
            self._clear = False
            (self._next if self._begins else self._arrived).append(packet)
