"""What a network costs on the GAP8: bytes, instructions in plain rv32imc, cycles of its cluster. Nothing but emulators.

A model is exported as `airtouch export` does, compiled for the chip's instruction set and run: over whole windows, as
a stream, and on one to eight cores with XPULP. Outputs come with the counts, so that a count is never of something
wrong.
"""

import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from airtouch.detector.best.model import BestModel
from airtouch.detector.paper.model import Model
from airtouch.detector.shared import export

from .build import CACHE, ROOT, build
from .elf import Elf
from .machine import Machine
from .xpulp import BARRIER, Cycles, XpulpMachine

#: folders of the C
KERNELS, FIRMWARE = ROOT / "gap8" / "kernels", ROOT / "firmware" / "kernels"
STATE_BYTES = 4096      #: room for a rolling network's or a stream's struct
#: names of `cores.CORES`
RV32IMC, XPULP = "rv32imc", "rv32im-xpulp"
#: sources of a network over whole windows
_WINDOWED = ("conv_int8", "dense_int8", "max_pool_int8", "network_int8", "sparse_dense_int8")
#: kind of network -> its sources
_KERNELS = {"window": _WINDOWED, "rolling": (*_WINDOWED, "rolling_int8", "fixed_scale"),
            "stream": ("stream_int8", "dense_int8", "sparse_dense_int8")}


@dataclass(frozen=True)
class Run:
    """outputs (n, outputs) int8, the instructions of each call that gave one or none, and bytes of stack."""

    outputs: np.ndarray
    instructions: np.ndarray
    stack: int


@dataclass(frozen=True)
class Chip:
    """A model compiled for the chip. kind: "window", "rolling" or "stream"; symbol: the network's name in C."""

    kind: str
    symbol: str
    elf: Path
    objects: dict[str, Path]
    source: str

    @property
    def flash_bytes(self) -> int:
        """Code of the kernels that it needs, and its constants with their structs."""
        code = sum(Elf(self.objects[f"{name}.c"]).code_bytes() for name in _KERNELS[self.kind])
        return code + self.constant_bytes

    @property
    def constant_bytes(self) -> int:
        """Weights, scales and layer structs, which lie in L1 when it runs."""
        return Elf(self.objects[self.source]).flash_bytes()


def compile_model(model: Model | BestModel, core: str = RV32IMC, folder: Path | None = None) -> Chip:
    """Export and compile; `folder`: where the sources lie or go, one for each model by default."""
    folder = folder or CACHE / "model" / model.digest[:24]
    export.export(model, folder, force=True)
    if isinstance(model, BestModel):
        kind, symbol, source = "stream", "airtouchStream", "airtouch_stream.c"
    elif model.scale:
        kind, symbol, source = "rolling", "airtouchRolling", "airtouch_rolling.c"
    else:
        kind, symbol, source = "window", "airtouchNetwork", "airtouch_model.c"
    sources = [KERNELS / f"{name}.c" for name in sorted({*_KERNELS[kind], *_WINDOWED})] + [folder / source]
    program = build(sources, core, include=[KERNELS, FIRMWARE, folder])
    return Chip(kind, symbol, program.elf, program.objects, source)


def windows(chip: Chip, quantised: np.ndarray, outputs: int = 2) -> Run:
    """Whole windows (n, inputs) int8, one core, plain rv32imc."""
    machine = Machine(chip.elf)
    x, arena = machine.allocate(quantised.shape[1]), _arena(machine, "networkInt8ArenaBytes", chip)
    machine.paint_stack()
    rows, counts = [], []
    for window in np.ascontiguousarray(quantised, np.int8):
        machine.write(x, window.tobytes())
        call = machine.call("networkInt8Run", machine.address(chip.symbol), x, arena)
        rows.append(np.frombuffer(machine.read(call.value, outputs), np.int8))
        counts.append(call.instructions)
    return Run(np.array(rows), np.array(counts), machine.stack_used())


def rolling(chip: Chip, quantised: np.ndarray, stride: int, outputs: int = 2) -> Run:
    """A flight (n, columns) int8, a sample a call; outputs of the calls that gave some."""
    machine = Machine(chip.elf)
    state, arena = machine.allocate(STATE_BYTES), _arena(machine, "rollingInt8ArenaBytes", chip, stride)
    assert machine.call("rollingInt8Init", state, machine.address(chip.symbol), stride, arena).value == 1
    return _steps(machine, quantised, outputs, "rollingInt8Step", state)


def stream(chip: Chip, quantised: np.ndarray, outputs: int = 3) -> Run:
    """The same for the network of `best`."""
    machine = Machine(chip.elf)
    state, arena = machine.allocate(STATE_BYTES), _arena(machine, "streamInt8ArenaBytes", chip)
    machine.call("streamInt8Reset", machine.address(chip.symbol), state, arena)
    return _steps(machine, quantised, outputs, "streamInt8Step", machine.address(chip.symbol), state)


def team_cycles(chip: Chip, window: np.ndarray, cores: int, outputs: int = 2) -> tuple[Cycles, np.ndarray]:
    """One window (inputs,) int8 on so many XPULP cores: cycles, and each core's output (cores, outputs) int8.

    Cycles are those of the model in tools/instruction_counts/xpulp.py.
    """
    machine = XpulpMachine(chip.elf)
    x, arena = machine.allocate(window.size), _arena(machine, "networkInt8ArenaBytes", chip)
    machine.write(x, np.ascontiguousarray(window, np.int8).tobytes())
    members = [machine.allocate(16) for _ in range(cores)]
    for core, member in enumerate(members):
        machine.write(member, struct.pack("<iiII", core, cores, BARRIER, 0))
    network = machine.address(chip.symbol)
    cycles = machine.team("networkInt8RunTeam", lambda core: (network, x, arena, members[core]), cores)
    return cycles, np.array([np.frombuffer(machine.read(value, outputs), np.int8) for value in cycles.values])


def _arena(machine: Machine, size: str, chip: Chip, *arguments: int) -> int:
    """Address of an arena for the network, whose bytes the C function `size` gives."""
    return machine.allocate(machine.call(size, machine.address(chip.symbol), *arguments).value)


def _steps(machine: Machine, quantised: np.ndarray, outputs: int, function: str, *arguments: int) -> Run:
    """Call a C function with each sample (n, columns) int8 after the other arguments."""
    x = machine.allocate(quantised.shape[1])
    machine.paint_stack()
    rows, counts = [], []
    for sample in np.ascontiguousarray(quantised, np.int8):
        machine.write(x, sample.tobytes())
        call = machine.call(function, *arguments, x)
        if call.value:
            rows.append(np.frombuffer(machine.read(call.value, outputs), np.int8))
        counts.append(call.instructions)
    return Run(np.array(rows), np.array(counts), machine.stack_used())
