"""Cross-compiles C files into a static program for one of the flight processors, from PyPI alone.

`ziglang` (PyPI) is a whole cross compiler: clang, linker and runtime library. Where the
distribution's GCC is asked for and present it is used instead. A program is named by the hash of
all that goes into it, so that a second build is a look into a folder.
"""

import hashlib
import importlib.util
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

from airtouch.errors import AirTouchError

from .cores import CORES, Core
from .elf import Elf

ROOT = Path(__file__).resolve().parents[2]  #: of the checkout
CACHE = ROOT / "build" / "emulator"  #: where programs lie, each in a folder named by its digest
LIBC = Path(__file__).resolve().parent / "libc"  #: as much of a C library as zig lacks for these cores

#: As the desktop library is compiled: without contraction a multiply-add rounds twice on both.
FLAGS = ("-std=c11", "-ffp-contract=off", "-fno-math-errno", "-Wall", "-Wextra", "-Wdouble-promotion", "-Werror",
         "-fno-unwind-tables", "-fno-asynchronous-unwind-tables", "-fomit-frame-pointer", "-g0")
#: zig's own, to compile as the distribution's GCC does
_ZIG_FLAGS = ("-fhosted", "-fno-sanitize=undefined", "-fno-stack-protector")


@dataclass(frozen=True)
class Program:
    """A linked program and the objects it is made of, by the name of their source."""

    elf: Path
    objects: dict[str, Path]


def compilers(core: str) -> list[str]:
    """What can compile for this core here: "zig", "gcc", both or none."""
    zig = ["zig"] if importlib.util.find_spec("ziglang") else []
    return zig + (["gcc"] if shutil.which(CORES[core].gcc) else [])


def build(
    sources: Sequence[Path], core: str, *, include: Sequence[Path] = (), defines: Sequence[str] = (),
    optimise: str = "-O2", compiler: str | None = None, flags: Sequence[str] = (), cache: Path = CACHE,
) -> Program:
    """Compiles and links `sources` (no main, every function kept) for "cortex-m4" or "rv32imc".

    include: folders of headers; defines: "NAME" or "NAME=VALUE"; flags: after all others; compiler: "zig" or
    "gcc", by default $AIRTOUCH_CROSS or zig where it is installed, whose version is pinned, so that counts can be
    compared.
    Raises AirTouchError with the compiler's words where the sources do not compile, and where there is no
    compiler.
    """
    target = _core(core)
    chosen = _compiler(core, compiler)
    sources, include = [Path(s).resolve() for s in sources], [Path(i).resolve() for i in include]
    flags = [*FLAGS, optimise, *(f"-D{d}" for d in defines), *(f"-I{folder}" for folder in include), *flags]
    folder = cache / core / _digest(target, chosen, flags, sources, include)
    program = Program(folder / "program.elf", {s.name: folder / f"{s.stem}.o" for s in sources})
    if not program.elf.is_file():
        _make(folder, target, chosen, flags, sources, cache)
    return program


def compile_objects(sources: Sequence[Path], core: str, folder: Path, *, include: Sequence[Path] = (),
                    flags: Sequence[str] = (), cache: Path = CACHE) -> list[Path]:
    """Compiles `sources` into `folder`, one object each, and links nothing: for code that calls an operating system.

    Raises AirTouchError as `build` does.
    """
    target = _core(core)
    command, _ = _commands(target, _compiler(core, None))
    objects = [folder / f"{Path(source).stem}.o" for source in sources]
    if len(set(objects)) < len(objects):
        raise AirTouchError("two sources have the same file name")
    for source, target_file in zip(sources, objects, strict=True):
        _run([*command, *FLAGS, *(f"-I{path}" for path in include), *flags, "-c", source, "-o", target_file],
             _environment(cache))
    return objects


def _environment(cache: Path) -> dict[str, str]:
    """The process's environment, with zig's caches in ours."""
    return {**os.environ, "ZIG_GLOBAL_CACHE_DIR": str(cache / "zig"), "ZIG_LOCAL_CACHE_DIR": str(cache / "zig")}


def _core(name: str) -> Core:
    """The core of that name. Raises AirTouchError for an unknown one."""
    if name not in CORES:
        raise AirTouchError(f"no core {name!r}: there are {', '.join(CORES)}")
    return CORES[name]


def _compiler(core: str, name: str | None) -> str:
    """The compiler of this name, else that of AIRTOUCH_CROSS, else the first available."""
    available = compilers(core)
    name = name or os.environ.get("AIRTOUCH_CROSS") or (available[0] if available else "zig")
    if name not in available:
        raise AirTouchError(f"no {name} compiler for {core}: `pip install ziglang`, or install {CORES[core].gcc}")
    return name


def _commands(core: Core, compiler: str) -> tuple[list[str], list[str]]:
    """The compiler with its target, to compile and to link."""
    if compiler == "zig":
        base = [sys.executable, "-m", "ziglang", "cc", *core.zig_flags, *_ZIG_FLAGS, f"-I{LIBC}"]
        return base, [*base, "-Wl,--gc-sections"]
    base = [core.gcc, *core.gcc_flags]
    return base, [*base, "-nostartfiles", "-Wl,--gc-sections"]


def _compiler_version(core: Core, compiler: str) -> str:
    """The version of a compiler, as text."""
    if compiler == "zig":
        return version("ziglang")
    return subprocess.run([core.gcc, "--version"], capture_output=True, text=True, check=True).stdout


def _digest(core: Core, compiler: str, flags: list[str], sources: list[Path], include: list[Path]) -> str:
    """Hash of everything that a compiled program depends on."""
    headers = [path for folder in include for path in sorted(folder.glob("**/*.h"))]
    text = hashlib.sha256(repr((core, compiler, _compiler_version(core, compiler), flags)).encode())
    for path in [*sources, *headers, *sorted(LIBC.iterdir()), Path(__file__)]:
        text.update(f"\0{path.name}\0".encode())
        text.update(path.read_bytes())
    return text.hexdigest()[:24]


def _make(folder: Path, core: Core, compiler: str, flags: list[str], sources: list[Path], cache: Path) -> None:
    """Everything in a folder of its own, which then takes its name: two builds at once do no harm."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    compile_, link = _commands(core, compiler)
    environment = _environment(cache)
    extra = [LIBC / "libc.c"] if compiler == "zig" else []
    with tempfile.TemporaryDirectory(dir=folder.parent) as work:
        new = Path(work) / "new"
        new.mkdir()
        objects = [new / f"{source.stem}.o" for source in [*sources, *extra]]
        if len({path.name for path in objects}) < len(objects):
            raise AirTouchError("two sources have the same file name")
        for source, target in zip([*sources, *extra], objects, strict=True):
            _run([*compile_, *flags, "-c", source, "-o", target], environment)
        libraries = [] if compiler == "zig" else ["-lm", "-lc", "-lgcc"]
        roots = [f"-Wl,-u,{name}" for path in objects[:len(sources)]
                 for name, symbol in Elf(path).symbols.items() if symbol.is_global]
        _run([*link, "-Wl,-e,0", "-T", LIBC / f"{core.name}.ld", *roots, *objects, *libraries,
              "-o", new / "program.elf"], environment)
        try:
            new.rename(folder)
        except OSError:
            if not (folder / "program.elf").is_file():
                raise


def _run(command: list, environment: dict[str, str]) -> None:
    """Run the cross compiler. Raises AirTouchError with its message if it fails."""
    run = subprocess.run([str(c) for c in command], capture_output=True, text=True, env=environment)
    if run.returncode:
        words = (run.stderr or run.stdout).strip()
        raise AirTouchError(f"{Path(str(command[-1])).name}: the cross compiler says: {words[:2000]}")
