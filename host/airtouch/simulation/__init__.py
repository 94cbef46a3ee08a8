"""A Crazyflie simulator whose every effect can be switched on, off and up.

`batch.simulate` flies many flights of a scenario, `flight.fly` one; `effects` is the
registry. What the equations are is in host/docs/simulate.md.
"""

import contextlib
import os
from pathlib import Path


def _drop_stale_machine_code() -> None:
    """Remove cached machine code when any source of this package has changed.

    numba looks only at the file of a compiled function, not at the files of the functions
    that it calls, and would fly yesterday's equations.
    """
    folder = Path(__file__).parent
    sources = sorted(folder.rglob("*.py"))
    stamp = "\n".join(f"{p.relative_to(folder)} {s.st_mtime_ns} {s.st_size}" for p in sources for s in [p.stat()])
    kept = folder / "__pycache__" / "sources.stamp"
    with contextlib.suppress(OSError):
        if kept.is_file() and kept.read_text() == stamp:
            return
        for index in folder.rglob("__pycache__/*.nbi"):
            index.unlink(missing_ok=True)
        kept.parent.mkdir(exist_ok=True)
        temporary = kept.with_suffix(f".{os.getpid()}")
        temporary.write_text(stamp)
        temporary.replace(kept)


_drop_stale_machine_code()
