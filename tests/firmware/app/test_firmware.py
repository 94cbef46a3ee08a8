"""The STM32 app as the Crazyflie runs it: cross-compiled, emulated, and its names beside those of the virtual drone."""

import importlib.util
import os
import re
import shutil
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from airtouch import vehicle as vehicles
from airtouch.crazyflie import flash
from airtouch.detector.shared import vehicle_header
from airtouch.detector.shared.channels import level_acceleration
from airtouch.kernels.app_core import DETECTORS, PARAMS, AppCore, Gap8Core
from airtouch.kernels.library import ffi, lib
from airtouch.logs.flight_log import GYRO, PWM
from airtouch.simulation import scenario
from airtouch.simulation.flight import fly
from airtouch.sitl import app as sitl
from firmware.make import ROOT, make
from tools.firmware.call_graph import deepest
from tools.instruction_counts import build
from tools.instruction_counts.cores import CORTEX_M4
from tools.instruction_counts.elf import Elf
from tools.instruction_counts.machine import Machine

CORE, APP = ROOT / "firmware" / "app" / "core", ROOT / "firmware" / "app" / "src"
GLUE = (APP / "airtouch_app.c").read_text()
KERNELS = ("band_power", "cross_spectrum", "disturbance_force", "edge_decoder", "edge_pipeline", "feature_window",
           "fr_cfar", "motion_channels", "stream_detector")
SOURCES = [*sorted(CORE.glob("app_*.c")),
           *(ROOT / "firmware" / "link" / f"{name}.c" for name in ("edge_link", "link_sender")),
           *(ROOT / "firmware" / "kernels" / f"{name}.c" for name in KERNELS),
           *(ROOT / "gap8" / "kernels" / f"{name}.c" for name in ("dense_int8", "sparse_dense_int8", "stream_int8")),
           *(ROOT / "gap8" / "model" / f"airtouch_{name}.c" for name in ("stream",))]
INCLUDES = [APP, CORE, *(ROOT / folder for folder in (
    "firmware/link", "firmware/kernels", "gap8/kernels", "gap8/model"))]
RAM_BUDGET = 20_480  # bytes of appCore_t
STACK_BUDGET = 1_000  # bytes below appMain's own
#: instructions of a step on average, link included: 16800 are 1 % of the 168 MHz core at 100 Hz
INSTRUCTION_BUDGET = {"cfar": 8_400, "best": 42_000, "best-gap8": 12_000, "paper-gap8": 12_000,
                      "paper-stream-gap8": 12_000}
SYMBOLS = """
#include "app_core.h"
const unsigned appCoreBytes = sizeof(appCore_t), appLogAt = __builtin_offsetof(appCore_t, log);
"""


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    if not build.compilers("cortex-m4"):
        pytest.skip("no cross compiler: pip install ziglang")
    extra = tmp_path_factory.mktemp("symbols") / "symbols.c"
    extra.write_text(SYMBOLS)
    return build.build([*SOURCES, extra], "cortex-m4", include=INCLUDES, optimise="-Os")


class Emulated:
    """The app's core on a Cortex-M4F."""

    def __init__(self, program, detector):
        self.machine = machine = Machine(program.elf)
        self.bytes, log_at = (struct.unpack("<I", machine.read(n, 4))[0] for n in ("appCoreBytes", "appLogAt"))
        self.core, self.packet = machine.allocate(self.bytes), machine.allocate(98)
        self.sample, self.params = machine.allocate(ffi.sizeof("appSample_t")), machine.allocate(64)
        self.log_at = self.core + log_at
        machine.call("appParamsDefaults", self.params)
        machine.write(self.params + 1, bytes([detector]))
        self.first = machine.call("appCoreInit", self.core, self.params, 1, 7).instructions
        self.instructions = []

    def step(self, acc, gyro, pwm, gap8):
        """One step with its packets, and the answers of a GAP8; the log after it."""
        machine, count = self.machine, 0
        machine.write(self.sample, struct.pack("<3f3f4f5fI", *acc, *gyro, *pwm, *(np.nan,) * 5, 0))
        count += machine.call("appCoreStep", self.core, self.sample).instructions
        for _ in range(2):
            outcome = machine.call("appCoreOutgoing", self.core, self.packet)
            count += outcome.instructions
            if outcome.value == 0:
                break
            count += machine.call("appCoreSent", self.core, 1).instructions
            reply = gap8.take(machine.read(self.packet, outcome.value))
            machine.write(self.packet, reply)
            count += machine.call("appCoreReceive", self.core, self.packet, len(reply)).instructions
        self.instructions.append(count)
        return ffi.from_buffer("appLog_t *", machine.read(self.log_at, ffi.sizeof("appLog_t")))


@pytest.fixture(scope="module")
def signals():
    log = fly(scenario.load("paper-4cm"), vehicles.load(), seed=3)
    return level_acceleration(log), log.stack(GYRO), log.stack(PWM)


@pytest.mark.parametrize("detector", range(5), ids=DETECTORS)
def test_the_core_runs_on_a_cortex_m4_within_its_budget(program, signals, detector):
    emulated, desktop = Emulated(program, detector), AppCore({"detector": detector}, have_gap8=True, nonce=7)
    link_a, link_b = Gap8Core(), Gap8Core()
    for acc, gyro, pwm in zip(*(s[600:1300] for s in signals), strict=True):
        log = emulated.step(np.float32(acc), np.float32(gyro), np.float32(pwm), link_a)
        desktop.step(acc, gyro, pwm)
        for packet in desktop.packets():
            desktop.receive(link_b.take(packet))
    expected = desktop.log
    assert list(log.logit) == list(expected.logit) and log.edges == expected.edges
    for name in ("feature", "force", "cfarPower", "threshold"):
        value, truth = (getattr(log, name), getattr(expected, name))
        value, truth = (value, truth) if isinstance(value, float) else (list(value), list(truth))
        np.testing.assert_allclose(value, truth, rtol=1e-4)
    steady = np.array(emulated.instructions[300:])
    stack = emulated.machine.stack_used()
    print(f"{DETECTORS[detector]}: {steady.mean():.0f} instructions a step, {steady.max()} at worst, start "
          f"{emulated.first}; core {emulated.bytes} bytes, stack {stack} bytes")
    assert steady.mean() <= INSTRUCTION_BUDGET[DETECTORS[detector]]
    assert emulated.bytes <= RAM_BUDGET and stack <= STACK_BUDGET


def undefined(path):
    """Names that an object file needs from elsewhere."""
    data = path.read_bytes()
    at, (size, count) = struct.unpack_from("<I", data, 32)[0], struct.unpack_from("<HH", data, 46)
    sections = [struct.unpack_from("<10I", data, at + i * size) for i in range(count)]
    table = next(s for s in sections if s[1] == 2)
    strings = sections[table[6]][4]
    names = set()
    for entry in range(table[4], table[4] + table[5], 16):
        name, _, _, _, _, section = struct.unpack_from("<IIIBBH", data, entry)
        if section == 0 and name:
            names.add(data[strings + name:data.index(b"\0", strings + name)].decode())
    return names


def test_no_double_and_no_heap_in_the_cross_compiled_core(program):
    needed = set().union(*(undefined(program.objects[source.name]) for source in SOURCES))
    assert "expf" in needed
    assert not {name for name in needed if name.startswith("__aeabi_d") or "2d" in name or "alloc" in name}
    assert not {name for name in needed if name.startswith("__aeabi_f")}, "single precision must be the processor's own"


def test_log_and_parameter_names_are_those_of_the_virtual_drone():
    kinds = {"LOG_FLOAT": "float", "LOG_UINT8": "uint8_t", "LOG_UINT16": "uint16_t", "LOG_UINT32": "uint32_t"}
    logs = re.findall(r"LOG_ADD(?:_BY_FUNCTION)?\((\w+), (\w+), &(?:core\.log\.)?(\w+)(?:\[(\d)\])?\)", GLUE)
    declared = {name: (kinds[kind], "health" if field == "healthLogger" else field, int(at or -1))
                for kind, name, field, at in logs}
    assert declared == sitl.LOGS
    fields = dict(ffi.typeof("appLog_t").fields)
    for kind, field, at in declared.values():
        inner = fields[field].type
        assert (inner.item if at >= 0 else inner).cname == kind
    params = {name: field for _, name, field in re.findall(r"PARAM_ADD\((\w+), (\w+), &wantedParams\.(\w+)\)", GLUE)}
    assert params == sitl.PARAMS
    assert {field for _, field, _ in declared.values()} == set(fields)
    assert set(params.values()) == {name for name, _ in ffi.typeof("appParams_t").fields}


def test_the_build_lists_every_source_that_the_core_needs():
    text = (APP / "Kbuild").read_text()
    listed = {Path(name).stem for name in re.findall(r"[\w./]+\.o", text)}
    assert {source.stem for source in SOURCES} <= listed


@pytest.mark.slow
@pytest.mark.parametrize("config, platform", [("app-config", "cf2"), ("app-config-tap", "cf2"),
                                              ("app-config-gap8", "cf2"), ("app-config", "cf21bl")])
def test_the_image_links_with_the_firmware(config, platform):
    base = os.environ.get("CRAZYFLIE_BASE")
    if not base or shutil.which("arm-none-eabi-gcc") is None:
        pytest.skip("set CRAZYFLIE_BASE to a checkout of the firmware, and install arm-none-eabi-gcc")
    process = make("firmware", f"CRAZYFLIE_BASE={base}", f"CONFIG={config}", f"PLATFORM={platform}",
                   "NETWORKS=" + ("no" if platform == "cf21bl" else ""))
    assert process.returncode == 0 and "warning:" not in process.stderr, process.stderr[-3000:]
    path = Path((ROOT / "build/firmware/image").read_text().strip())
    assert path.name == platform + config.removeprefix("app-config") + ".bin"
    assert process.stdout.rstrip().endswith("takes it")
    assert flash.inspect(ROOT / path).target == "stm32"
    image = Elf(ROOT / "build/firmware/firmware/app/build" / f"{platform}.elf")
    assert any("cpx" in name.lower() for name in image.symbols) == (config == "app-config-gap8")
    assert firmwares_default(image, "wantedParams") == defaults()
    size, _, _ = deepest(ROOT / "build" / "firmware", "appMain")
    assert size <= STACK_BUDGET


def cross_compiler():
    """A command that compiles for the Cortex-M4."""
    if shutil.which("arm-none-eabi-gcc"):
        return ["arm-none-eabi-gcc", *CORTEX_M4.gcc_flags]
    if importlib.util.find_spec("ziglang"):
        return [sys.executable, "-m", "ziglang", "cc", *CORTEX_M4.zig_flags, f"-I{build.LIBC}"]
    pytest.skip("no cross compiler: pip install ziglang")


def test_the_image_holds_the_defaults_of_the_parameters(tmp_path):
    # paramGetDefault() of the firmware looks a default up in the image of .data; it takes all else for zero.
    shutil.copy(ROOT / vehicle_header.FOLDER / "crazyflie-2.1-flow.h", tmp_path / "airtouch_vehicle.h")
    process = subprocess.run([*cross_compiler(), "-std=gnu11", "-Os", "-fdata-sections", "-DCONFIG_PLATFORM_CF2",
                              f"-I{tmp_path}", f"-I{Path(__file__).parent / 'crazyflie'}",
                              *(f"-I{i}" for i in INCLUDES), "-c", APP / "airtouch_app.c", "-o", tmp_path / "app.o"],
                             capture_output=True, text=True)
    assert process.returncode == 0, process.stderr[:3000]
    section, = (s for s in Elf(tmp_path / "app.o").sections if s.name == ".data.wantedParams")
    assert fields(section.data) == defaults()


def firmwares_default(image, name):
    """What paramGetDefault() finds for the parameters in a variable of this image."""
    at, start, end, load_address = (image.symbols[n].address for n in (name, "_sdata", "_edata", "_sidata"))
    assert start <= at <= end, "outside .data the firmware takes a default to be zero"
    data = image.path.with_suffix(".bin").read_bytes()
    begin = load_address + at - start - flash.STM32_FLASH.start
    return fields(data[begin:begin + ffi.sizeof("appParams_t")])


def fields(data):
    """Field -> value of an appParams_t's bytes."""
    params = ffi.from_buffer("appParams_t *", bytearray(data), require_writable=True)
    return {name: getattr(params, name) for name in PARAMS}


def defaults():
    """Field -> value as appParamsDefaults() gives them."""
    params = ffi.new("appParams_t *")
    lib.appHostDefaults(params)
    return {name: getattr(params, name) for name in PARAMS}


def test_the_deepest_stack_is_summed_along_calls(tmp_path):
    node = 'node: {{ title: "{0}" label: "{0}\\nx.c:1\\n{1} bytes (static)" }}\n'
    edge = 'edge: {{ sourcename: "{}" targetname: "{}" label: "x.c:1" }}\n'
    (tmp_path / "a.ci").write_text(node.format("appMain", 100) + node.format("a.c:short", 500) + node.format("deep", 30)
                                   + edge.format("appMain", "a.c:short") + edge.format("appMain", "deep"))
    (tmp_path / "b.ci").write_text(node.format("deeper", 600) + edge.format("deep", "deeper")
                                   + edge.format("deeper", "memcpy") + edge.format("deeper", "deep"))
    size, chain, unknown = deepest(tmp_path, "appMain")
    assert (size, chain[:3]) == (730, ["appMain", "deep", "deeper"])
    assert unknown == {"memcpy", "deep (calls itself)"}
    with pytest.raises(SystemExit, match="no nobody in any .ci file"):
        deepest(tmp_path, "nobody")
