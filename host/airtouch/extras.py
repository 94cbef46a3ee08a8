"""What is not in the base install, told at once and by the command that installs it."""

from importlib.util import find_spec

from airtouch.errors import AirTouchError

#: extra of `pip install 'airtouch[EXTRA]'` -> modules that it brings
EXTRAS = {"plots": ("matplotlib",), "train": ("tensorflow", "keras", "sklearn", "matplotlib"), "fly": ("cflib",),
          "map": ("shapely", "matplotlib"), "vision": ("cv2", "matplotlib"), "scale": ("distributed",),
          "parquet": ("pyarrow",),
          "ulog": ("pyulog",), "ros": ("rosbags",), "rerun": ("rerun",), "pandas": ("pandas",)}


def need(extra: str, purpose: str) -> None:
    """Raise AirTouchError, before any work, where a module of the extra is missing; purpose: what it is wanted for."""
    missing = lacking(extra)
    if missing:
        raise AirTouchError(f"{purpose} needs {', '.join(missing)}: pip install 'airtouch[{extra}]'")


def lacking(extra: str) -> list[str]:
    """The modules of an extra that are not installed."""
    return [name for name in EXTRAS[extra] if not _there(name)]


def _there(name: str) -> bool:
    try:
        return find_spec(name) is not None
    except (ModuleNotFoundError, ValueError):  # its loader is missing, or it stands as None in sys.modules
        return False
