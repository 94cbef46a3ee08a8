"""Optional dependencies. A missing one is reported before any work, with the command that installs it."""

from importlib.util import find_spec

from airtouch.errors import AirTouchError

#: extra of `pip install 'airtouch[EXTRA]'` -> modules that it brings
EXTRAS = {"plots": ("matplotlib",), "train": ("tensorflow", "keras", "sklearn", "matplotlib"), "fly": ("cflib",),
          "map": ("shapely", "matplotlib"), "vision": ("cv2", "matplotlib"), "scale": ("distributed",),
          "parquet": ("pyarrow",),
          "ulog": ("pyulog",), "ros": ("rosbags",), "rerun": ("rerun",), "pandas": ("pandas",)}


def need(extra: str, purpose: str) -> None:
    """Raise AirTouchError, with the pip command, if a module of the extra is missing; purpose: who needs it."""
    missing = lacking(extra)
    if missing:
        raise AirTouchError(f"{purpose} needs {', '.join(missing)}: pip install 'airtouch[{extra}]'")


def lacking(extra: str) -> list[str]:
    """The modules of an extra that are not installed."""
    return [name for name in EXTRAS[extra] if not _there(name)]


def _there(name: str) -> bool:
    try:
        return find_spec(name) is not None
    except (ModuleNotFoundError, ValueError):  # its loader is missing, or sys.modules has None for it
        return False
