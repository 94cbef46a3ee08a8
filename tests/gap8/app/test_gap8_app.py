"""The GAP8 app: compiles, fits L1, and its cores share the windowed network without changing a bit."""

import os
import shutil
import struct
import subprocess
from pathlib import Path

import numpy as np
import pytest

from airtouch.kernels.app_core import DETECTORS, AppCore, Gap8Core
from patience import HANG_S
from tools.instruction_counts import build, elf
from tools.instruction_counts.machine import Machine

ROOT = Path(__file__).parents[3]
APP = ROOT / "gap8" / "app" / "src"
INCLUDES = [ROOT / folder for folder in ("gap8/app/src", "gap8/kernels", "gap8/model", "firmware/link",
                                         "firmware/kernels")]
FLAGS = ["-std=gnu11", "-O2", "-Wall", "-Wextra", "-Werror", *(f"-I{folder}" for folder in INCLUDES)]
PORTABLE = [*sorted((ROOT / "firmware" / "link").glob("*.c")), ROOT / "firmware/kernels/feature_window.c",
            *sorted((ROOT / "gap8" / "kernels").glob("*.c")), APP / "gap8_core.c",
            *(ROOT / "gap8" / "model" / f"airtouch_{name}.c" for name in ("model", "rolling", "stream"))]
MODELS = ("airtouchStream", "airtouchNetwork", "airtouchRolling", "airtouchRollingScale")  # as in gap8Models_t
L1_BYTES = 65_536
TEAM = """
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "gap8_core.h"

static const gap8Models_t models = GAP8_EXPORTED;
static gap8Core_t alone, shared;
static pthread_barrier_t meeting;
static __thread int32_t number;
static gap8Team_t team;
static void (*job)(void *);
static void *jobArgument;

static void *runOne(void *core) {
  number = (int32_t)(long)core;
  job(jobArgument);
  return NULL;
}

static void forkTeam(void (*work)(void *), void *argument) {
  pthread_t threads[8];
  job = work;
  jobArgument = argument;
  for (long i = 1; i < team.cores; i++) pthread_create(&threads[i], NULL, runOne, (void *)i);
  runOne((void *)0);
  for (int i = 1; i < team.cores; i++) pthread_join(threads[i], NULL);
}

static int32_t coreNumber(void) { return number; }
static void meet(void *unused) { (void)unused; pthread_barrier_wait(&meeting); }

int main(int argc, char **argv) {
  (void)argc;
  team = (gap8Team_t){forkTeam, coreNumber, meet, atoi(argv[1])};
  pthread_barrier_init(&meeting, NULL, (unsigned)team.cores);
  if (gap8CoreInit(&alone, &models, NULL) != 3 || gap8CoreInit(&shared, &models, &team) != 3) return 2;
  edgeLinkPacket_t packet = {.type = EDGE_LINK_RESET, .session = 1};
  packet.reset.algorithm = EDGE_LINK_PAPER;
  edgeLinkDigest(AIRTOUCH_MODEL_SHA256, packet.reset.digest);
  int answers = 0;
  for (int i = -1; i < 130; i++) {
    uint8_t bytes[EDGE_LINK_MAX_BYTES], one[EDGE_LINK_MAX_BYTES], other[EDGE_LINK_MAX_BYTES];
    if (i >= 0) {
      packet = (edgeLinkPacket_t){.type = EDGE_LINK_FEATURES, .session = 1, .sequence = (uint32_t)i};
      packet.features.count = 1;
      const float row[3] = {(float)(i * i % 97), (float)(i * 31 % 53), (float)(i % 11)};
      memcpy(packet.features.sample[0], row, sizeof row);
    }
    const uint16_t length = edgeLinkPack(&packet, bytes);
    const uint16_t first = gap8CoreTake(&alone, bytes, length, one);
    if (first != gap8CoreTake(&shared, bytes, length, other) || memcmp(one, other, first)) return 1;
    edgeLinkParse(one, first, &packet);
    answers += packet.result.count > 0;
  }
  printf("%d\\n", answers);
  return 0;
}
"""


@pytest.fixture(scope="module")
def compiler():
    path = shutil.which(os.environ.get("CC", "cc"))
    if path is None:
        pytest.skip("no C compiler on this machine")
    return path


@pytest.mark.parametrize("source", ["main.c", "l1_network.c", "l1_rolling.c", "l1_stream.c"])
def test_glue_compiles_against_the_interfaces_it_uses(compiler, source, tmp_path):
    # The stand-ins in pmsis/ were taken from gap_sdk and lib/cpx; with those themselves it compiles too.
    process = subprocess.run([compiler, *FLAGS, f"-I{Path(__file__).parent / 'pmsis'}", "-c", APP / source, "-o",
                              tmp_path / "unit.o"], capture_output=True, text=True)
    assert process.returncode == 0, process.stderr


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    if not build.compilers("rv32imc"):
        pytest.skip("no cross compiler: pip install ziglang")
    size = tmp_path_factory.mktemp("size") / "size.c"
    size.write_text('#include "gap8_core.h"\nchar gap8CoreBytes[sizeof(gap8Core_t)];\n')
    return build.build([*PORTABLE, size], "rv32imc", include=INCLUDES)


def test_core_and_networks_fit_l1_with_the_stacks(program):
    symbols = elf.Elf(program.elf).symbols
    core = symbols["gap8CoreBytes"].size
    networks = sum(symbol.size for name in ("model", "rolling", "stream")
                   for symbol in elf.Elf(program.objects[f"airtouch_{name}.c"]).symbols.values())
    stacks = 8 * 2048
    print(f"L1: core {core}, networks {networks}, stacks {stacks} bytes of {L1_BYTES}")
    assert 5_000 < core < 10_000
    assert core + networks + stacks < L1_BYTES - 12_288  # the rest is for the SDK


@pytest.fixture(scope="module")
def team(compiler, tmp_path_factory):
    folder = tmp_path_factory.mktemp("team")
    (folder / "team.c").write_text(TEAM)
    process = subprocess.run([compiler, *FLAGS, *PORTABLE, folder / "team.c", "-pthread", "-lm", "-o", folder / "team"],
                             capture_output=True, text=True)
    assert process.returncode == 0, process.stderr
    return folder / "team"


@pytest.mark.parametrize("cores", [1, 2, 4, 8])
def test_a_team_of_cores_gives_the_same_packets(team, cores):
    process = subprocess.run([team, str(cores)], capture_output=True, text=True, timeout=HANG_S)
    assert process.returncode == 0 and int(process.stdout) == 31


@pytest.mark.parametrize("detector, most", [("best-gap8", 90_000), ("paper-gap8", 2_200_000),
                                            ("paper-stream-gap8", 60_000)])
def test_on_an_emulated_core_the_replies_are_those_of_the_desktop(program, detector, most):
    machine, desktop = Machine(program.elf), Gap8Core()
    core, packet, reply = (machine.allocate(n) for n in (elf.Elf(program.elf).symbols["gap8CoreBytes"].size, 98, 98))
    models = machine.allocate(4 * len(MODELS))
    machine.write(models, struct.pack(f"<{len(MODELS)}I", *map(machine.address, MODELS)))
    assert machine.call("gap8CoreInit", core, models, 0).value == 3
    app, counts = AppCore({"detector": DETECTORS.index(detector)}, have_gap8=True), []
    rng = np.random.default_rng(0)
    for _ in range(320):
        app.step(rng.normal(0, 1, 3) + [0, 0, 9.81], rng.normal(0, 0.3, 3), rng.uniform(40_000, 45_000, 4))
        for request in app.packets():
            machine.write(packet, request)
            call = machine.call("gap8CoreTake", core, packet, len(request), reply)
            expected = desktop.take(request)
            assert machine.read(reply, call.value & 0xFFFF) == expected
            app.receive(expected)
            counts.append(call.instructions)
    steady = np.array(counts[-10:])
    print(f"{detector}: {steady.mean():.0f} instructions a packet on one rv32imc core, {steady.max()} at worst, stack "
          f"{machine.stack_used()} bytes")
    assert app.log.answers > 0 and steady.max() <= most
    assert machine.stack_used() <= 1_000  # main.c gives each core 2048


@pytest.mark.parametrize("arguments, words", [([], "say where CPX for the GAP8 is"),
                                              (["AIDECK={aideck}"], "no GAP8 SDK at GAP_SDK_HOME=")])
def test_make_gap8_says_what_is_missing(arguments, words, tmp_path):
    header = tmp_path / "lib" / "cpx" / "inc" / "cpx.h"
    header.parent.mkdir(parents=True)
    header.touch()
    process = subprocess.run(["make", "-C", ROOT, "gap8", *(a.format(aideck=tmp_path) for a in arguments)],
                             capture_output=True, text=True)
    assert process.returncode != 0 and words in process.stderr
    assert "GAP_SDK_HOME" not in words or "docker run" in process.stderr
