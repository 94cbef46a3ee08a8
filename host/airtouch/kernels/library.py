"""The shared library of C kernels, opened without a compiler or Python headers."""

from importlib.util import find_spec
from pathlib import Path
from typing import Any

from cffi import FFI

from airtouch.errors import AirTouchError

REMEDY = "run `make setup` in the checkout, or `pip install .` where a C compiler is"


def _declarations(folder: Path) -> str:
    """The shared structs, then every *_batch.h of the folder `batch`, without preprocessor lines."""
    headers = [folder / "kernel_types.h", folder / "app_types.h", *sorted(folder.glob("*_batch.h"))]
    lines = [line for header in headers for line in header.read_text(encoding="utf-8").splitlines()]
    return "\n".join(line for line in lines if not line.lstrip().startswith("#"))


def _open(ffi: FFI) -> Any:
    spec = find_spec("airtouch.kernels._kernels")
    if spec is None or spec.origin is None:
        raise AirTouchError(f"the C kernels are not built: {REMEDY}")
    try:
        return ffi.dlopen(spec.origin)
    except OSError as error:
        raise AirTouchError(f"{spec.origin}: cannot be opened ({error}): {REMEDY}") from None


class Library:
    """The C functions and constants by name. Raises AirTouchError for one that an older build does not have."""

    def __init__(self, opened: Any) -> None:
        self._opened = opened

    def __getattr__(self, name: str) -> Any:
        try:
            found = getattr(self._opened, name)
        except AttributeError:
            raise AirTouchError(f"the built C kernels have no {name}: {REMEDY}") from None
        setattr(self, name, found)  # the next call finds it at once
        return found


ffi = FFI()
ffi.cdef(_declarations(Path(__file__).parent / "batch"))
lib = Library(_open(ffi))
