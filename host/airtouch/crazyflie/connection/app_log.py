"""The state of the app on the drone: the LOG group `airtouch`, as one log block."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from airtouch.crazyflie.connection.blocks import Block, available

GROUP = "airtouch"
#: names as in firmware/app/src/airtouch_app.c; 25 bytes
WANTED = Block("airtouch", 50, tuple((f"{GROUP}.{name}", kind) for name, kind in (
    ("prob", "FP16"), ("edges", "uint16_t"), ("edge", "uint8_t"), ("edgeStep", "uint32_t"),
    ("steps", "uint32_t"), ("health", "uint16_t"), ("load", "uint16_t"), ("timeouts", "uint16_t"),
    ("lost", "uint16_t"), ("dropped", "uint16_t"), ("detector", "uint8_t"), ("link", "uint8_t"))))
KINDS = {1: "entry", 2: "exit"}
DETECTORS = {0: "FR-CFAR on the STM32", 1: "best on the STM32", 2: "best on the GAP8", 3: "paper on the GAP8",
             4: "paper-stream on the GAP8"}
#: appHealth_t of firmware/app
HEALTH = {1: "a value was not finite", 2: "the GAP8 does not answer", 4: "the GAP8 fills its window",
          8: "the GAP8 has another model", 16: "a setting was out of range",
          32: "another detector runs than the wanted one", 64: "the CPX queue was full",
          128: "a step began late", 256: "the app stands still", 512: "a log variable is missing",
          1024: "the estimator gives no horizontal acceleration: choose the Kalman filter or the 1 kHz tap",
          2048: "FR-CFAR runs alone: the networks were trained for another vehicle, or are none that the app takes"}


@dataclass(frozen=True)
class AppState:
    """The app's state in one packet: P(over a platform), number of edges, kind and age (s) of the last, and faults."""

    probability: float
    edges: int
    kind: str
    age_s: float
    detector: str
    load_us: float
    faults: tuple[str, ...]


def block(known: Collection[str]) -> Block | None:
    """The app's log block, with the variables that this firmware has; None without the app."""
    block = available(WANTED, known)
    return block if any(name == f"{GROUP}.prob" for name in block.names) else None


def state(values: Mapping[str, float]) -> AppState:
    """The state in a packet {log variable: value}. A missing probability is NaN; other missing variables count as 0."""
    def value(name: str, missing: float = 0.0) -> float:
        return float(values.get(f"{GROUP}.{name}", missing))

    health = int(value("health"))
    faults = [text for bit, text in HEALTH.items() if health & bit]
    if health & 2 and value("timeouts"):
        faults[faults.index(HEALTH[2])] += f" ({int(value('timeouts'))} timeouts)"
    age = max(value("steps") - value("edgeStep"), 0.0) * 0.01 if f"{GROUP}.edgeStep" in values else 0.0
    kind = KINDS.get(int(value("edge")), "edge")
    detector = DETECTORS.get(int(value("detector", -1)), "the app's detector")
    return AppState(value("prob", float("nan")), int(value("edges")), kind, age, detector, value("load"),
                    tuple(faults))
