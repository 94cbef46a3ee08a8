"""Requests for log blocks, and the drone's answers to them.

An answer names the block by its number. Every attempt uses a new number, and an answer decides only about the
attempt that it names, because a late answer may arrive when the next block has been requested. cflib repeats a
request without an answer after 0.2 s, so the drone may get it twice. Its second answer, "the number is taken" or
"larger than a packet", is then ignored.
"""

import errno
import queue
import time
from dataclasses import dataclass, field
from typing import Any

from airtouch.crazyflie.connection.blocks import Block
from airtouch.crazyflie.connection.ticks import host_clock_s
from airtouch.errors import AirTouchError

BLOCK_S = 1.5  #: s to wait for the first packet of a log block
BLOCK_ATTEMPTS = 6  #: attempts to start a block; a lost "create" makes the "append" after it fail
LOG_PORT, SETTINGS_CHANNEL, DATA_CHANNEL = 5, 1, 2
DELETE_BLOCK, CREATE_BLOCK, LOG_HEADER = 2, 6, 4  #: bytes before the values: number, 24-bit clock
INCOMPLETE = 256  #: no error of the firmware: an "append" that came before its "create" is lost
FORGET_S = 0.3  #: s between two requests to delete the same block
LOG_COMMANDS = {0: "create", 1: "append to", 3: "start", 6: "create", 7: "append to"}
LOG_ERRORS = {errno.ENOENT: "a variable or the block is unknown to it", errno.E2BIG: "it is larger than a packet",
              errno.ENOEXEC: "it does not know the command",
              errno.ENOMEM: "its memory for log blocks is full; restart the drone",
              errno.EEXIST: "another block has its number", INCOMPLETE: "it left variables out"}


@dataclass(frozen=True)
class Sample:
    """A log packet: name of its block, drone's 24-bit clock (ms), arrival (host's clock, s) and values."""

    block: str
    stamp: int
    arrival_s: float
    values: dict[str, float]


@dataclass(eq=False)
class Attempt:
    """A request for a block under one number.

    answers: (command, error) of each refusal, None for the first packet of data.
    repeated: commands that were sent again.
    """

    block: Block
    config: Any  #: cflib's LogConfig
    answers: "queue.SimpleQueue[tuple[int, int] | None]" = field(default_factory=queue.SimpleQueue)
    repeated: set[int] = field(default_factory=set)
    delivered: bool = False  #: a packet of data came


class LogBlocks:
    """The log blocks of one drone. cflib's thread puts the packets of the requested blocks into `samples`."""

    def __init__(self, samples: "queue.SimpleQueue[Sample]") -> None:
        self._samples = samples
        self._newest: dict[str, Attempt] = {}
        self._deleted_s: dict[int, float] = {}
        self._cf: Any = None

    def attach(self, cf: Any) -> None:
        """Use this connection from now on. It has no blocks, and their numbers start again."""
        self._cf = cf
        self._newest, self._deleted_s = {}, {}
        cf.add_header_callback(self._on_answer, LOG_PORT, SETTINGS_CHANNEL)
        cf.add_header_callback(self._on_data, LOG_PORT, DATA_CHANNEL)
        cf.resent.add_callback(self._on_repeat)

    def start(self, block: Block) -> None:
        """Start a log block. Returns when its first packet has arrived.

        Raises AirTouchError with the drone's reason if it refuses.
        """
        reason = f"log block {block.name}: the drone sends none of it; is the link good?"
        for _ in range(BLOCK_ATTEMPTS):
            attempt, until = self._ask(block), time.monotonic() + BLOCK_S
            while attempt.answers.empty() and time.monotonic() < until:
                time.sleep(0.01)
            if attempt.answers.empty():
                continue
            refusal = attempt.answers.get()
            if refusal is None:
                return
            command, code = refusal
            reason = (f"log block {block.name} rejected: the drone could not {LOG_COMMANDS[command]} it: "
                      f"{LOG_ERRORS.get(code, f'error {code}')}")
        raise AirTouchError(reason)

    def _ask(self, block: Block) -> Attempt:
        """Request the block under a new number, and give up the attempt under its old one."""
        from cflib.crazyflie.log import LogConfig

        config = LogConfig(block.name, block.period_ms)
        attempt = Attempt(block, config)
        for name, kind in block.variables:
            config.add_variable(name, kind)

        def take(stamp: int, values: dict[str, float], _: Any) -> None:
            if self._newest.get(block.name) is attempt:
                if not attempt.delivered:
                    attempt.delivered = True
                    attempt.answers.put(None)
                self._samples.put(Sample(block.name, stamp, host_clock_s(), values))

        config.data_received_cb.add_callback(take)
        try:
            self._cf.log.add_config(config)
            if config.cf is None:
                raise AirTouchError(f"log block {block.name}: the link is closed")
            self._give_up(self._newest.get(block.name))
            self._newest[block.name] = attempt
            config.start()
        except (KeyError, AttributeError) as error:
            raise AirTouchError(f"log block {block.name}: {str(error).strip(chr(39))}") from None
        return attempt

    def _give_up(self, attempt: Attempt | None) -> None:
        """Remove an attempt from cflib's list, which holds 16 blocks and 128 variables."""
        if attempt is not None and attempt.config in self._cf.log.log_blocks:
            self._cf.log.log_blocks.remove(attempt.config)

    def _attempts(self) -> dict[int, Attempt]:
        return {attempt.config.id: attempt for attempt in list(self._newest.values())}

    def _on_data(self, packet: Any) -> None:
        """Refuse a packet that lacks some of its block's variables, and delete a block that was given up."""
        number, size = packet.data[0], len(packet.data) - LOG_HEADER
        attempt = self._attempts().get(number)
        if attempt is not None:
            if size < attempt.block.size:
                attempt.answers.put((CREATE_BLOCK, INCOMPLETE))
        elif time.monotonic() - self._deleted_s.get(number, float("-inf")) > FORGET_S:
            from cflib.crtp.crtpstack import CRTPPacket

            self._deleted_s[number] = time.monotonic()
            delete = CRTPPacket()
            delete.set_header(LOG_PORT, SETTINGS_CHANNEL)
            delete.data = (DELETE_BLOCK, number)
            self._cf.send_packet(delete)

    def _on_answer(self, packet: Any) -> None:
        if len(packet.data) < 3 or packet.data[0] not in LOG_COMMANDS or packet.data[2] == 0:
            return
        command, number, code = packet.data[:3]
        attempt = self._attempts().get(number)
        if attempt is None or command in attempt.repeated and code in (errno.EEXIST, errno.E2BIG):
            return
        attempt.answers.put((command, code))

    def _on_repeat(self, packet: Any) -> None:
        if (packet.port, packet.channel) == (LOG_PORT, SETTINGS_CHANNEL) and len(packet.data) >= 2:
            attempt = self._attempts().get(packet.data[1])
            if attempt is not None:
                attempt.repeated.add(packet.data[0])
