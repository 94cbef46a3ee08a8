"""The kernels that fly on the STM32, emulated: a whole flight through any of them, and what each step costs."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from airtouch.kernels.edge_pipeline import _event_dtype, config_struct
from airtouch.kernels.library import ffi
from airtouch.reference.edge_decoder import LOGITS
from airtouch.reference.edge_pipeline import EdgePipelineConfig
from airtouch.reference.motion_channels import NAMES
from airtouch.vehicle import Vehicle, load

from .build import ROOT, Program, build
from .elf import Elf
from .machine import Machine

#: folders of the C
FIRMWARE, GAP8, MODEL = ROOT / "firmware" / "kernels", ROOT / "gap8" / "kernels", ROOT / "gap8" / "model"
#: the network's kernels
_NETWORK = [GAP8 / f"{name}.c" for name in ("stream_int8", "dense_int8", "sparse_dense_int8")]
#: files that are compiled
SOURCES = [*sorted(FIRMWARE.glob("*.c")), *_NETWORK, MODEL / "airtouch_stream.c",
           Path(__file__).with_name("flight_code.c")]
#: folders of headers
INCLUDE = [FIRMWARE, GAP8, MODEL]

#: edgeSample_t
SAMPLE = np.dtype([("acc", "<f4", 3), ("gyro", "<f4", 3), ("pwm", "<f4", 4), ("vbat", "<f4"),
                   ("thrust_axis", "<f4", 3), ("probability", "<f4")])
#: edgeEvent_t
EVENT = _event_dtype()
#: event of the stream's detector
STREAM_EVENT = np.dtype({"names": ["logits", "ready", "edge", "airborne"],
                         "formats": [("<f4", len(LOGITS)), "u1", "u1", "u1"],
                         "offsets": [0, *(4 * len(LOGITS) + i for i in range(3))], "itemsize": 4 * len(LOGITS) + 4})


@dataclass(frozen=True)
class Kernel:
    """A kernel by its step in flight_code.c: types of its input and output, sources and state."""

    step: str
    takes: np.dtype
    gives: np.dtype
    sources: tuple[str, ...]
    state: tuple[str, ...] = ()


_FLOAT = np.dtype("<f4")  #: one number
#: sources of what several kernels hold
_BAND, _FORCE = ("band_power",), ("disturbance_force",)
#: sources of the network of `best`
_NET = ("stream_int8", "dense_int8", "sparse_dense_int8", "airtouch_stream")
#: kernels by name
KERNELS = {
    "band_power": Kernel("stepBandPower", np.dtype(("<f4", 9)), np.dtype(("<f4", 9)), _BAND,
                         ("bandPowerState", "bandPowerStorage")),
    "cross_spectrum": Kernel("stepCrossSpectrum", np.dtype(("<f4", 9)), np.dtype(("<f4", 3)), ("cross_spectrum",)),
    "disturbance_force": Kernel("stepDisturbanceForce", SAMPLE, EVENT, _FORCE),
    "fr_cfar": Kernel("stepFrCfar", _FLOAT, _FLOAT, ("fr_cfar",), ("frCfarState", "frCfarStorage")),
    "edge_pipeline": Kernel("stepEdgePipeline", SAMPLE, EVENT,
                            (*_BAND, "cross_spectrum", *_FORCE, "fr_cfar", "feature_window", "edge_pipeline"),
                            ("edgePipelineState",)),
    "motion_channels": Kernel("stepMotionChannels", SAMPLE, np.dtype(("<f4", len(NAMES))), ("motion_channels", *_FORCE),
                              ("motionChannelsState",)),
    "stream_int8": Kernel("stepStreamInt8", np.dtype(("i1", len(NAMES))), np.dtype("i1"), _NET, ("streamArena",)),
    "edge_decoder": Kernel("stepEdgeDecoder", np.dtype(("<f4", len(LOGITS))), np.dtype("u1"), ("edge_decoder",),
                           ("edgeDecoderState",)),
    "stream_detector": Kernel("stepStreamDetector", SAMPLE, STREAM_EVENT,
                              ("motion_channels", *_FORCE, "stream_detector", "edge_decoder", *_NET),
                              ("streamDetectorState", "streamArena")),
}


@dataclass(frozen=True)
class Steps:
    """A flight through a kernel: outputs (n, ...), whether a step computed its output, instructions of each step."""

    output: np.ndarray
    ready: np.ndarray
    instructions: np.ndarray


@dataclass(frozen=True)
class Cost:
    """Of one step: instructions, their mean over the steps that give an output and the worst of all; in bytes the
    code with its constants, the state, and the stack below the caller."""

    instructions_mean: float
    instructions_worst: int
    flash_bytes: int
    ram_bytes: int
    stack_bytes: int


def compile_flight_code(core: str = "cortex-m4", *, optimise: str = "-O2", compiler: str | None = None) -> Program:
    """Every kernel, its states and its steps as one program."""
    return build(SOURCES, core, include=INCLUDE, optimise=optimise, compiler=compiler)


class FlightCode:
    """The program in a machine. `begin` puts every state at its start; `fly` runs a flight through one kernel."""

    def __init__(self, program: Program, vehicle: Vehicle | None = None):
        self.program = program
        self.machine = Machine(program.elf)
        config = config_struct(EdgePipelineConfig(), vehicle or load("crazyflie-2.1-flow"))
        self._config = bytes(ffi.buffer(config))
        self.begin()

    def begin(self) -> None:
        """As after power-on, states set up, stack painted."""
        self.machine.reset()
        where = self.machine.allocate(len(self._config))
        self.machine.write(where, self._config)
        if not self.machine.call("flightBegin", where).value:
            raise ValueError("the flight code refuses its own settings")
        self.machine.paint_stack()

    def fly(self, name: str, inputs: np.ndarray) -> Steps:
        """inputs: (n, ...) as the kernel takes them, from its state after `begin` on."""
        self.begin()
        kernel, machine = KERNELS[name], self.machine
        data = _rows(inputs, kernel.takes)
        size, room = kernel.takes.itemsize, -(-kernel.gives.itemsize // 4) * 4
        source, target = machine.allocate(len(data)), machine.allocate(max(len(inputs), 1) * room)
        machine.write(source, data)
        calls = [machine.call(kernel.step, source + i * size, target + i * room) for i in range(len(inputs))]
        out = np.frombuffer(machine.read(target, len(inputs) * room), dtype=np.uint8).reshape(-1, room)
        out = np.ascontiguousarray(out[:, :kernel.gives.itemsize])
        base, shape = kernel.gives.base, kernel.gives.shape
        output = out.view(base).reshape(len(inputs), *shape)
        return Steps(output, np.array([c.value for c in calls], dtype=bool), np.array([c.instructions for c in calls]))

    def cost(self, name: str, steps: Steps) -> Cost:
        """What `fly` has just cost."""
        kernel, elf = KERNELS[name], self.machine.elf
        objects = [Elf(self.program.objects[f"{source}.c"]) for source in kernel.sources]
        state = sum(elf.symbols[symbol].size for symbol in kernel.state)
        return Cost(float(steps.instructions[steps.ready].mean()), int(steps.instructions.max()),
                    sum(o.flash_bytes() for o in objects), state + sum(o.ram_bytes() for o in objects),
                    self.machine.stack_used())


def _rows(inputs: np.ndarray, takes: np.dtype) -> bytes:
    """The inputs as the bytes that the C function reads."""
    if takes.names:
        return np.ascontiguousarray(inputs, dtype=takes).tobytes()
    return np.ascontiguousarray(inputs, dtype=takes.base).tobytes()


def samples(acc: np.ndarray, gyro: np.ndarray, pwm: np.ndarray, *, thrust_axis: np.ndarray | None = None,
            probability: np.ndarray | None = None) -> np.ndarray:
    """(n,) of edgeSample_t from acc (n, 3), gyro (n, 3) and PWM (n, 4); the battery's voltage is unknown."""
    rows = np.zeros(len(acc), dtype=SAMPLE)
    rows["acc"], rows["gyro"], rows["pwm"], rows["vbat"] = acc, gyro, pwm, np.nan
    rows["thrust_axis"] = np.nan if thrust_axis is None else thrust_axis
    rows["probability"] = np.nan if probability is None else probability
    return rows


def made_flight(n: int = 1500, seed: int = 0) -> np.ndarray:
    """(n,) of edgeSample_t: a second on the ground, take-off, hover with bursts of motion in the band and odd
    values."""
    rng = np.random.default_rng(seed)
    t = np.arange(n)
    burst = 1.0 + 6.0 * ((t // 150) % 3 == 2)
    swing = np.sin(2 * np.pi * 7.0 * t / 100.0)[:, None] * burst[:, None]
    acc = rng.normal(0, 0.2, (n, 3)) + 0.05 * swing + [0, 0, 9.81]
    gyro = rng.normal(0, 0.05, (n, 3)) + 0.05 * swing
    pwm = 48000 + rng.normal(0, 800, (n, 4)) + swing * [300, -300, 250, -250]
    pwm[:min(n, 100)] = 0
    rows = samples(acc, gyro, pwm, probability=(burst > 1) * 0.9)
    for _ in range(8):
        rows[("acc", "gyro", "pwm")[rng.integers(3)]][rng.integers(n), rng.integers(3)] = (
            np.nan, np.inf, -np.inf, 3e38, -1e-42, 1e15, 65535.0, -1.0)[rng.integers(8)]
    return rows
