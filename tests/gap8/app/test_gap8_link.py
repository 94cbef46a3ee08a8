"""The GAP8 app links: what its objects need, the SDK and the libraries on its link line provide."""

import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest

from tools.instruction_counts import build
from tools.instruction_counts.elf import Elf

HERE = Path(__file__).parent
APP = HERE.parents[2] / "gap8" / "app"
PROVIDED = tomllib.loads((HERE / "gap8_symbols.toml").read_text())
SDK_LIBRARIES = ["-lgcc"]  # what the SDK's rules put behind APP_LDFLAGS, after -nostdlib
RULES = """
print:
	@echo "$(strip $(APP_SRCS))"
	@echo "$(strip $(APP_INC))"
	@echo "$(strip $(APP_LDFLAGS))"
"""


@pytest.fixture(scope="module")
def makefile(tmp_path_factory):
    """Sources, include folders and linker flags that gap8/app/Makefile gives the SDK's rules."""
    make_path = shutil.which("make")
    if make_path is None:
        pytest.skip("no make on this machine")
    rules = tmp_path_factory.mktemp("rules")
    (rules / "pmsis_rules.mk").write_text(RULES)
    command = [make_path, "--no-print-directory", "-C", APP, f"RULES_DIR={rules}", "AIDECK=/aideck", "print"]
    process = subprocess.run(command, capture_output=True, text=True, check=True)
    sources, include, libraries = (line.split() for line in process.stdout.splitlines())
    ours = [[APP / path for path in paths if not path.startswith("/aideck/")] for paths in (sources, include)]
    return *ours, libraries


@pytest.fixture(scope="module")
def needs(makefile, tmp_path_factory):
    """Names that the app's objects use and none of them defines."""
    if "zig" not in build.compilers("rv32imc"):
        pytest.skip("no cross compiler: pip install ziglang")
    sources, include, _ = makefile
    objects = build.compile_objects(sources, "rv32imc", tmp_path_factory.mktemp("objects"),
                                    include=[*include, HERE / "pmsis"], flags=["-O3", "-std=gnu11"])
    elves = [Elf(path) for path in objects]
    defined = {name for elf in elves for name, symbol in elf.symbols.items() if symbol.is_global}
    return set().union(*(elf.undefined for elf in elves)) - defined


def test_every_name_the_app_needs_is_one_of_a_known_provider(needs):
    provided = {name for names in PROVIDED.values() for name in names}
    assert needs - provided == set()
    assert provided & needs, "it does need some"


def test_the_link_line_has_each_library_that_the_app_needs(makefile, needs):
    *_, flags = makefile
    line = [flag for flag in flags if flag.startswith("-l")] + SDK_LIBRARIES
    for library in ("-lm", "-lc", "-lgcc"):
        assert not needs & set(PROVIDED[library]) or library in line, f"{library} is missing"
    # A static library serves only those before it: libm calls libc, and both call libgcc.
    assert line.index("-lm") < line.index("-lc") < len(line) - 1 - line[::-1].index("-lgcc")
