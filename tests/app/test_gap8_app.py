"""The GAP8 app: compiles, fits L1, and its cores share the windowed network without changing a bit."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from tools.emulator import build, elf

ROOT = Path(__file__).parents[2]
APP = ROOT / "gap8" / "app" / "src"
INCLUDES = [ROOT / folder for folder in ("gap8/app/src", "gap8/kernels", "gap8/model", "firmware/link",
                                         "firmware/kernels")]
FLAGS = ["-std=gnu11", "-O2", "-Wall", "-Wextra", "-Werror", *(f"-I{folder}" for folder in INCLUDES)]
PORTABLE = [*sorted((ROOT / "firmware" / "link").glob("*.c")), ROOT / "firmware/kernels/feature_window.c",
            *sorted((ROOT / "gap8" / "kernels").glob("*.c")), APP / "gap8_core.c", ROOT / "gap8/model/airtouch_model.c",
            ROOT / "gap8/model/airtouch_stream.c"]
L1_BYTES = 65_536
TEAM = """
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "gap8_core.h"

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
  gap8CoreInit(&alone, &airtouchStream, &airtouchNetwork, NULL);
  gap8CoreInit(&shared, &airtouchStream, &airtouchNetwork, &team);
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
    found = shutil.which(os.environ.get("CC", "cc"))
    if found is None:
        pytest.skip("no C compiler on this machine")
    return found


@pytest.mark.parametrize("source", ["main.c", "l1_network.c", "l1_stream.c"])
def test_glue_compiles_against_the_interfaces_it_uses(compiler, source, tmp_path):
    # The stand-ins in pmsis/ were taken from gap_sdk and lib/cpx; with those themselves it compiles too.
    run = subprocess.run([compiler, *FLAGS, f"-I{Path(__file__).parent / 'pmsis'}", "-c", APP / source, "-o",
                          tmp_path / "unit.o"], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr


def test_core_and_networks_fit_l1_with_the_stacks(tmp_path):
    if "zig" not in build.compilers("rv32imc"):
        pytest.skip("no cross compiler: pip install ziglang")
    (tmp_path / "size.c").write_text('#include "gap8_core.h"\nchar gap8CoreBytes[sizeof(gap8Core_t)];\n')
    program = build.build([*PORTABLE, tmp_path / "size.c"], "rv32imc", include=INCLUDES)
    symbols = elf.Elf(program.elf).symbols
    core = symbols["gap8CoreBytes"].size
    networks = sum(s.size for s in elf.Elf(program.objects["airtouch_model.c"]).symbols.values()) + \
        sum(s.size for s in elf.Elf(program.objects["airtouch_stream.c"]).symbols.values())
    stacks = 2048 + 7 * 1024
    print(f"L1: core {core}, networks {networks}, stacks {stacks} bytes of {L1_BYTES}")
    assert 5_000 < core < 13_000
    assert core + networks + stacks < L1_BYTES // 2 + 16_384


@pytest.mark.parametrize("cores", [1, 2, 4, 8])
def test_a_team_of_cores_gives_the_same_packets(compiler, cores, tmp_path):
    (tmp_path / "team.c").write_text(TEAM)
    build_ = subprocess.run([compiler, *FLAGS, *PORTABLE, tmp_path / "team.c", "-pthread", "-lm", "-o",
                             tmp_path / "team"], capture_output=True, text=True)
    assert build_.returncode == 0, build_.stderr
    run = subprocess.run([tmp_path / "team", str(cores)], capture_output=True, text=True, timeout=60)
    assert run.returncode == 0 and int(run.stdout) == 31


@pytest.mark.parametrize("arguments, words", [([], "say where CPX for the GAP8 is"),
                                              (["AIDECK={aideck}"], "no GAP8 SDK at GAP_SDK_HOME=")])
def test_make_gap8_says_what_is_missing(arguments, words, tmp_path):
    header = tmp_path / "lib" / "cpx" / "inc" / "cpx.h"
    header.parent.mkdir(parents=True)
    header.touch()
    run = subprocess.run(["make", "-C", ROOT, "gap8", *(a.format(aideck=tmp_path) for a in arguments)],
                         capture_output=True, text=True)
    assert run.returncode != 0 and words in run.stderr
    assert "GAP_SDK_HOME" not in words or "docker run" in run.stderr
