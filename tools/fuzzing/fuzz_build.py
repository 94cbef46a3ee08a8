"""Programs of the fuzz targets: which engine this machine has, the sources, and a program for each target."""

import hashlib
import os
import shutil
import subprocess
import tempfile
import threading
import tomllib
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]  #: of the checkout
FUZZ = ROOT / "tests" / "fuzz"  #: the targets' sources
BUILD = ROOT / "build" / "fuzz"  #: objects, programs, corpora, findings
#: of the C that flies; the harnesses have address alone
SANITIZERS = "address,undefined,float-cast-overflow,float-divide-by-zero"
#: of every source
FLAGS = ["-std=gnu11", "-O1", "-g1", "-ffp-contract=off", "-Wall", "-Wextra", "-fno-sanitize-recover=all"]
#: folders of headers
INCLUDES = ["tests/fuzz", "tests/fuzz/link", "tests/fuzz/networks", "firmware/kernels", "firmware/link",
            "firmware/app/core", "gap8/kernels", "gap8/model", "gap8/app/src"]
XPULP = ["-DAIRTOUCH_XPULP_EMULATION"]  #: the GAP8's path of the int8 kernels
#: A target's own flags, for its harness and the sources below gap8/, and whose source it is.
VARIANTS = {"networks_xpulp": ("networks", XPULP), "gap8": ("gap8", XPULP)}
#: In long runs, the shipped network's kernels with address alone: half of the time of the targets that run it at every
#: step. `gap8` runs the same network, and `networks`, `streams` and `rolling` any other, under every sanitizer.
ADDRESS = ("-fno-sanitize=undefined,float-cast-overflow,float-divide-by-zero",)
SHIPPED = ("app", "stream_detector")  #: these targets
LONG = ("-O2",)  #: of runs in which the inputs cost more than the compiler: a third less for those of a network


@dataclass(frozen=True)
class Engine:
    """A compiler and the flags that make a target."""

    name: str
    compiler: str
    product: tuple[str, ...]  #: the sources that fly: their edges are counted, the harness's are not
    link: tuple[str, ...]


def targets() -> dict[str, Path]:
    """The targets by name, each with its source."""
    sources = {path.stem: path for path in sorted(FUZZ.glob("*/*.c"))}
    return sources | {name: sources[base] for name, (base, _) in VARIANTS.items() if base in sources}


def _works(compiler: str, *flags: str) -> bool:
    """Whether a compiler makes a small target with these flags."""
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "probe.c"
        source.write_text("#include <stddef.h>\nint LLVMFuzzerTestOneInput(const char *d, size_t n);\n"
                          "int LLVMFuzzerTestOneInput(const char *d, size_t n) { return d == NULL && n > 0; }\n"
                          "#ifdef MAIN\nint main(void) { return 0; }\n#endif\n")
        run = subprocess.run([compiler, *flags, source, "-o", Path(folder) / "probe"], capture_output=True)
        return run.returncode == 0


@cache
def engine(name: str = "") -> Engine | None:
    """The best engine of this machine, or the one of this name; None without one."""
    clang = shutil.which(os.environ.get("CLANG", "clang"))
    if name in ("", "libfuzzer") and clang and _works(clang, f"-fsanitize=fuzzer,{SANITIZERS}"):
        # Without tracing comparisons, which costs half of the time: the harnesses draw what parsers compare with.
        return Engine("libfuzzer", clang, ("-fsanitize-coverage=inline-8bit-counters,indirect-calls,pc-table",),
                      (f"-fsanitize=fuzzer,{SANITIZERS}",))
    cc = shutil.which(os.environ.get("CC", "cc"))
    if name in ("", "standalone") and cc and _works(cc, f"-fsanitize={SANITIZERS}", "-DMAIN"):
        return Engine("standalone", cc, (), (f"-fsanitize={SANITIZERS}",))
    return None


def product_sources() -> list[Path]:
    """The C that flies, as pyproject.toml lists it for the host's library."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    listed = project["tool"]["setuptools"]["ext-modules"][0]["sources"]
    return [ROOT / name for name in listed if not name.startswith("host/")]


@cache
def _headers() -> bytes:
    """Hash of all headers."""
    folders = [FUZZ, *(ROOT / name for name in INCLUDES)]
    paths = sorted({path for folder in folders for path in folder.glob("*.h")})
    return hashlib.sha256(b"".join(path.read_bytes() for path in paths)).digest()


def _compile(made_by: Engine, source: Path, flags: tuple[str, ...]) -> Path:
    """The object of a source; made once for each content of source and headers."""
    # The harness needs address alone: redzones around what it gives to the product.
    checks = "address" if FUZZ in source.parents else SANITIZERS
    command = [made_by.compiler, *FLAGS, f"-fsanitize={checks}", *flags, *(f"-I{ROOT / name}" for name in INCLUDES)]
    content = source.read_bytes() + _headers() + "\0".join(command).encode()
    target = BUILD / "objects" / f"{source.stem}-{hashlib.sha256(content).hexdigest()[:16]}.o"
    if not target.exists():
        target.parent.mkdir(parents=True, exist_ok=True)
        part = target.with_suffix(f".{os.getpid()}-{threading.get_ident()}")  # two threads may make one
        run = subprocess.run([*command, "-c", source, "-o", part], capture_output=True, text=True)
        if run.returncode:
            raise SystemExit(f"{source}:\n{run.stderr}")
        part.rename(target)
    return target


def build(names: list[str], made_by: Engine, replaced: dict[Path, Path] | None = None, folder: Path | None = None,
          flags: tuple[str, ...] = (), only: list[Path] | None = None) -> dict[str, Path]:
    """The programs of the named targets.

    replaced: other sources in the place of the product's; only: of these alone.
    """
    folder = folder or BUILD / "bin" / "".join((made_by.name, *flags))  # a test may build beside a long run
    folder.mkdir(parents=True, exist_ok=True)
    sources = [(replaced or {}).get(path, path) for path in only or product_sources()]
    counted = made_by.product + flags
    driver = [FUZZ / "standalone.c"] if made_by.name == "standalone" else []

    def program(name: str) -> tuple[str, Path]:
        """A target's name and program."""
        more = (*VARIANTS.get(name, ("", []))[1], *(ADDRESS if flags == LONG and name in SHIPPED else ()))
        objects = [_compile(made_by, path, flags + more) for path in (targets()[name], *driver)]
        # From an archive only what the target needs is linked in, and counted.
        library = folder / f"lib{name}.a"
        library.unlink(missing_ok=True)
        members = [_compile(made_by, path, counted + (more if "gap8" in path.parts else ())) for path in sources]
        subprocess.run(["ar", "rcs", library, *members], check=True)
        target = folder / name
        subprocess.run([made_by.compiler, *made_by.link, *flags, *objects, library, "-lm", "-o", target], check=True)
        library.unlink()
        return name, target

    with ThreadPoolExecutor(2) as pool:
        list(pool.map(lambda path: _compile(made_by, path, counted), sources))
        return dict(pool.map(program, names))
