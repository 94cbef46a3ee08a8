"""How the simulator's functions are compiled.

They make no arrays of their own: what they need is handed in. So the compiler may leave out the counting
of references to arrays, atomic operations which took half of a flight's time. Dividing by zero gives inf,
which ends a flight as "not finite".
"""

import contextlib
import os
from functools import partial
from importlib import import_module
from pathlib import Path
from types import FunctionType
from typing import Any

from numba import njit

jit: Any = partial(njit, cache=True, error_model="numpy", _nrt=False)
#: for parts of a stage that are called in one place and take records of many arrays, which a call would copy
inlined: Any = partial(njit, error_model="numpy", _nrt=False, inline="always")


def compile_all() -> None:
    """Compile what every flight and every replay needs: half a minute the first time.

    Numba keeps it beside the sources or where it is told to, so that other processes only read it.
    """
    for name in ("batch", "replay"):
        import_module(f"airtouch.simulation.{name}")


def _nothing() -> None:
    pass


def _cache_folder(source: Path) -> Path:
    """Where numba keeps the machine code of a source: beside it, in NUMBA_CACHE_DIR or in the user's cache."""
    inside = FunctionType(_nothing.__code__.replace(co_filename=str(source)), globals())
    cached: Any = njit(cache=True)(inside)
    return Path(cached.stats.cache_path)


def _drop_stale_machine_code() -> None:
    """Remove cached machine code when any source of the simulator has changed.

    Numba looks only at the file of a compiled function, not at the files of the functions
    that it calls, and would fly yesterday's equations.
    """
    folder = Path(__file__).parent
    sources = sorted(folder.rglob("*.py"))
    stamp = "\n".join(f"{p.relative_to(folder)} {s.st_mtime_ns} {s.st_size}" for p in sources for s in [p.stat()])
    with contextlib.suppress(OSError, RuntimeError):  # RuntimeError: numba can write nowhere, and keeps nothing
        stamp_file = _cache_folder(Path(__file__)) / "sources.stamp"
        if stamp_file.is_file() and stamp_file.read_text() == stamp:
            return
        for one in {p.parent: p for p in sources}.values():
            for index in _cache_folder(one).glob("*.nbi"):
                index.unlink(missing_ok=True)
        stamp_file.parent.mkdir(parents=True, exist_ok=True)
        temporary = stamp_file.with_suffix(f".{os.getpid()}")
        temporary.write_text(stamp)
        temporary.replace(stamp_file)


_drop_stale_machine_code()
