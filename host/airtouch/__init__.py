"""AirTouch: edges below a nano-quadcopter, felt through the air under its rotors.

    import airtouch as at
    log = at.read("flight.csv")
    at.detect(log).edges
    at.gap.diagnose(log, baseline=["nominal_1.csv", "nominal_2.csv"]).effects

`airtouch.api` says what each function takes.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from airtouch import gap, logs
    from airtouch.api import adapt, detect, evaluate, from_pandas, read, simulate, to_pandas, write
    from airtouch.errors import AirTouchError
    from airtouch.logs.flight_log import FlightLog

__version__ = "0.1.0"
__all__ = ["AirTouchError", "FlightLog", "__version__", "adapt", "detect", "evaluate", "from_pandas", "gap", "logs",
           "read", "simulate", "to_pandas", "write"]
_FROM = {"AirTouchError": "airtouch.errors", "FlightLog": "airtouch.logs.flight_log",
         **dict.fromkeys(("adapt", "detect", "evaluate", "from_pandas", "read", "simulate", "to_pandas", "write"),
                         "airtouch.api")}


if not TYPE_CHECKING:  # so that a type checker tells a name that is not there
    def __getattr__(name: str) -> Any:
        """What is asked for, imported now."""
        if name in ("gap", "logs"):
            return importlib.import_module(f"airtouch.{name}")
        if name in _FROM:
            return getattr(importlib.import_module(_FROM[name]), name)
        raise AttributeError(f"module 'airtouch' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
