"""Objects of C sources for the tests' programs: each compiled once for its content, flags and headers.

They are in build/tests, and the processes of one test run share them: who comes second waits for the first.
"""

import fcntl
import hashlib
import subprocess
from collections.abc import Sequence
from pathlib import Path

FOLDER = Path(__file__).parents[2] / "build" / "tests"


def compiled(compiler: str, flags: Sequence[str | Path], sources: Sequence[Path]) -> tuple[list[Path], str]:
    """The objects of C sources, and what the compiler said where one does not compile (then there are none)."""
    words = [str(flag) for flag in flags]
    version = subprocess.run([compiler, "--version"], capture_output=True).stdout
    common = version + "\0".join(words).encode()
    common += b"".join(_headers(Path(flag.removeprefix("-I"))) for flag in words if flag.startswith("-I"))
    FOLDER.mkdir(parents=True, exist_ok=True)
    objects = []
    with (FOLDER / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        for source in sources:
            content = common + _headers(source.parent) + str(source).encode() + source.read_bytes()
            key = hashlib.sha256(content).hexdigest()[:24]
            objects.append(FOLDER / f"{source.stem}-{key}.o")
            if not objects[-1].exists():
                part = objects[-1].with_suffix(".part")
                process = subprocess.run([compiler, *words, "-c", source, "-o", part], capture_output=True, text=True)
                if process.returncode:
                    return [], process.stderr
                part.rename(objects[-1])
    return objects, ""


def _headers(folder: Path) -> bytes:
    """Names and contents of all headers in a folder."""
    return b"".join(str(h).encode() + h.read_bytes() for h in sorted(folder.rglob("*.h")))
