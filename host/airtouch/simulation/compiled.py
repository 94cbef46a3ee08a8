"""How the simulator's functions are compiled.

They make no arrays of their own: what they need is handed in. So the compiler may leave out the counting
of references to arrays, atomic operations which took half of a flight's time. Dividing by zero gives inf,
which ends a flight as "not finite".
"""

from functools import partial
from importlib import import_module
from typing import Any

from numba import njit

jit: Any = partial(njit, cache=True, error_model="numpy", _nrt=False)
#: for parts of a stage that are called in one place and take records of many arrays, which a call would copy
inlined: Any = partial(njit, error_model="numpy", _nrt=False, inline="always")


def compile_all() -> None:
    """Compile what every flight and every replay needs: half a minute the first time.

    Numba keeps it beside the sources, so that other processes only read it.
    """
    for name in ("batch", "replay"):
        import_module(f"airtouch.simulation.{name}")
