"""Fixtures that cost seconds, made once in a run of several workers."""

import fcntl
import os
import pickle


def once(factory, name, make):
    """What `make()` returns: the first worker that asks makes it, the others of this run read what it has written.

    factory: pytest's `tmp_path_factory`, whose folder is one run's own, so nothing is taken over from an earlier run.
    """
    folder = factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        folder = folder.parent  # of all workers
    path = folder / f"{name}.pickle"
    with open(folder / f"{name}.lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if path.exists():
            return pickle.loads(path.read_bytes())
        value = make()
        part = path.with_suffix(".part")
        part.write_bytes(pickle.dumps(value))
        part.rename(path)
    return value
