"""What the high-level commander is told. Without imports of the simulator, so that a drone is reached in a second."""

from dataclasses import dataclass

CODES = {"take-off": 7, "land": 8, "go": 12, "stop": 3}  #: command numbers in the answers; go is 4 before protocol 8


@dataclass(frozen=True)
class Command:
    """One command for the high-level commander: kind take-off, go, land or stop; metres, radians, seconds."""

    kind: str
    x_m: float = 0.0
    y_m: float = 0.0
    z_m: float = 0.0
    yaw_rad: float = 0.0
    seconds: float = 0.0
