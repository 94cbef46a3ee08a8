"""A Crazyflie simulator whose every effect can be switched on, off and up.

`batch.simulate` flies many flights of a scenario, `flight.fly` one; `loop` is one flight as stages over the record
of `state`. The folders: `flight_plan` (floor, platforms, mission), `body`, `sensors`, `firmware`, `effects` (the
registry, one file an effect), `workers` (batches over processes). The equations stand in host/docs/simulate.md.
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
    stamp_file = folder / "__pycache__" / "sources.stamp"
    with contextlib.suppress(OSError):
        if stamp_file.is_file() and stamp_file.read_text() == stamp:
            return
        for index in folder.rglob("__pycache__/*.nbi"):
            index.unlink(missing_ok=True)
        stamp_file.parent.mkdir(exist_ok=True)
        temporary = stamp_file.with_suffix(f".{os.getpid()}")
        temporary.write_text(stamp)
        temporary.replace(stamp_file)


_drop_stale_machine_code()
