"""A Crazyflie's STM32 in QEMU, with the image of build.py in it: frames to and from the board of hardware/.

Its time is that of its instructions: SHIFT says how long one takes. It waits for the desktop wherever it listens, so a
run depends on its inputs alone.
"""

import os
import select
import struct
import subprocess
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Self

import numpy as np

from airtouch.errors import AirTouchError

from ..instruction_counts.elf import Elf

SHIFT = 3  #: an instruction takes 2^3 ns: 125 million a second, as 168 MHz at 1.34 cycles each
PER_US = 1000 >> SHIFT  #: instructions a microsecond of the firmware's clock
PATIENCE_S = 120.0  #: of ours, for one frame
#: modes: the app's samples from the desktop; sensors from the desktop, motors to it
REPLAY, FLY = b"R", b"F"
FLOAT, SIGNED = 7, (4, 5, 6)  #: types of the firmware's log


class Board:
    """`with Board(elf, FLY, names) as board`: it starts, and stops with the block.

    names: log variables that each report holds. app: whether its task runs. whole_milliseconds: the firmware's clock of
    microseconds goes in thousands, so that nobody's run time shows in anybody's time stamps. console: what the
    firmware said so far. `hear` gives a frame and `say` sends one; `go` lets it run on.
    """

    def __init__(self, elf: Path, mode: bytes, names: Sequence[str], app: bool = True, ai_deck: bool = False,
                 whole_milliseconds: bool = False) -> None:
        self.elf, self.names, self.console = elf, list(names), ""
        self._begin = mode + bytes([app, ai_deck, whole_milliseconds])
        self._handlers: dict[str, Callable[[bytes], None]] = {}

    def __enter__(self) -> Self:
        """Start QEMU and open the two pipes to the board."""
        self._folder = tempfile.TemporaryDirectory(prefix="airtouch-board-")
        folder = Path(self._folder.name)
        for pipe in ("to_board", "from_board"):
            os.mkfifo(folder / pipe)
        command = ["qemu-system-arm", "-M", "netduinoplus2", "-display", "none", "-monitor", "none", "-serial", "none",
                   "-semihosting-config", "enable=on,target=native", "-icount", f"shift={SHIFT},align=off,sleep=off",
                   "-kernel", str(self.elf)]
        self._qemu = subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        self._to, self._from = self._open(folder / "to_board", os.O_WRONLY), os.open(folder / "from_board", os.O_RDONLY)
        self.say("B", self._begin)
        self.go()
        self.hear("R")
        self.types = self.ask("N", self.names)
        return self

    def __exit__(self, *_: object) -> None:
        """End QEMU and remove its folder."""
        self._qemu.kill()
        self._qemu.wait()
        for file in (self._to, self._from):
            os.close(file)
        self._folder.cleanup()

    def _open(self, path: Path, how: int) -> int:
        """Opening for writing succeeds once QEMU has opened the other end."""
        for _ in range(int(100 * PATIENCE_S)):
            try:
                file = os.open(path, how | os.O_NONBLOCK)
            except OSError:
                if self._qemu.poll() is not None:
                    break
                select.select([], [], [], 0.01)
            else:
                os.set_blocking(file, True)
                return file
        self._qemu.kill()
        raise AirTouchError(f"QEMU does not run the image: "
                            f"{self._qemu.communicate()[0].decode(errors='replace')[-500:]}")

    def ask(self, kind: str, names: Sequence[str]) -> list[int]:
        """Have names looked up in the firmware's tables: the type of each. AirTouchError where one is missing."""
        self.say(kind, b"".join(name.encode() + b"\0" for name in names))
        types = list(self.hear("T"))
        missing = [name for name, type_ in zip(names, types, strict=True) if type_ == 0]
        if missing:
            raise AirTouchError(f"the firmware has no log variable {', '.join(missing)}: is it of another release?")
        return types

    def on(self, kind: str, handler: Callable[[bytes], None]) -> None:
        """Have frames of a kind handled as they come."""
        self._handlers[kind] = handler

    def say(self, kind: str, content: bytes = b"") -> None:
        """Send a frame; it is read when the board next listens."""
        try:
            os.write(self._to, kind.encode() + struct.pack("<H", len(content)) + content)
        except BrokenPipeError:
            raise AirTouchError(f"the board has stopped; {self._last()}") from None

    def go(self) -> None:
        """Let it run on until it listens again."""
        self.say("G")

    def parameter(self, name: str, value: float) -> None:
        """Set a parameter by the firmware's own table."""
        self.say("P", struct.pack("<f", value) + name.encode() + b"\0")

    def hear(self, *wanted: str) -> bytes:
        """The next frame of one of these kinds; those of others go to their handlers. AirTouchError for a fault."""
        while True:
            kind, content = self._frame()
            if kind in wanted:
                return content
            if kind == "C":
                self.console += content.decode(errors="replace")
            elif kind == "!":
                raise AirTouchError(f"the firmware stopped: {content.decode(errors='replace')}; {self._last()}")
            elif kind == "X":
                registers = struct.unpack("<8I", content)
                raise AirTouchError(f"hard fault in {self._where(registers[6])}, called from "
                                    f"{self._where(registers[5])}; {self._last()}")
            elif kind in self._handlers:
                self._handlers[kind](content)

    def _frame(self) -> tuple[str, bytes]:
        """The next frame from the board: its kind and its content."""
        head = self._bytes(3)
        return chr(head[0]), self._bytes(struct.unpack("<H", head[1:])[0])

    def _bytes(self, length: int) -> bytes:
        """The next `length` bytes from the board. Raises AirTouchError if it stops or is silent for PATIENCE_S."""
        got = b""
        while len(got) < length:
            ready, _, _ = select.select([self._from], [], [], PATIENCE_S)
            new = os.read(self._from, length - len(got)) if ready else b""
            if not new:
                how = f"said nothing for {PATIENCE_S:.0f} s" if not ready else self._ending()
                raise AirTouchError(f"the board {how}; {self._last()}")
            got += new
        return got

    def _last(self) -> str:
        """The last line of the board's console, in words."""
        lines = self.console.strip().splitlines()
        return f"it said last: {lines[-1]}" if lines else "it had not said anything"

    def _where(self, address: int) -> str:
        """Function and offset of an address in the program."""
        return Elf(self.elf).where(address & ~1)

    def _ending(self) -> str:
        """The exit code of the board and the end of its output, in words."""
        output = self._qemu.communicate()[0].decode(errors="replace")
        return f"has stopped with code {self._qemu.returncode}. {output[-1000:]}"

    def values(self, report: bytes) -> dict[str, float]:
        """A report: `ms` of its clock, `latency` of the stabilizer's worst step since the last one, and the names'."""
        words = np.frombuffer(report, "<u4")
        values: dict[str, float] = {"ms": int(words[0]), "latency_us": int(words[1])}
        for name, type_, word in zip(self.names, self.types, words[2:], strict=True):
            if type_ == FLOAT:
                values[name] = word.view(np.float32)
            else:
                values[name] = int(word.view(np.int32) if type_ in SIGNED else word)
        return values

    def end(self) -> dict[str, int]:
        """Stop it where it listens: unused words of each task's stack."""
        self.say("E")
        rows = self.hear("K")
        return {rows[i:i + 10].split(b"\0")[0].decode(): struct.unpack_from("<H", rows, i + 10)[0]
                for i in range(0, len(rows), 12)}
