"""`collect`: from a connected drone to flights on the disk."""

import csv
import datetime
import io
import math
import os
import shutil
import time
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path
from threading import Event
from typing import Any

from airtouch import __version__, logs
from airtouch.crazyflie import checks, recorder
from airtouch.crazyflie.autopilot import Autopilot, Origin
from airtouch.crazyflie.connection import blocks
from airtouch.crazyflie.connection.drone import Drone, drain
from airtouch.crazyflie.connection.intake import Intake
from airtouch.crazyflie.flight import LINK_TIMEOUT_S, Flight
from airtouch.crazyflie.guard import guarding
from airtouch.crazyflie.mission import LANDING_MPS, Mission
from airtouch.crazyflie.recorder import LEAST_FREE_BYTES, Recorder
from airtouch.errors import AirTouchError
from airtouch.logs.edges import true_edges
from airtouch.logs.files import write_bytes
from airtouch.logs.flight_log import FlightLog

DECKS = ("bcFlow2", "bcFlow", "bcMultiranger", "bcAI", "bcZRanger2", "bcLighthouse4", "bcLoco")
FIRST_DATA_S = 3.0
PARAMETERS_S = 30.0  #: s to wait for a parameter; cflib fetches them all, one after the other
LINEAR_PROTOCOL = 8  #: lowest protocol version in which go-to can fly at constant speed
CAN_BE_ARMED, ARMED, FLYING = 1, 2, 16  #: bits of the supervisor's state
LANDED_S = 15.0  #: s to wait for a drone that is still landing after a killed flight
START_OVER = "sitl.startOver"  #: parameter that only a virtual drone has
ARMING_S = 1.0
RESET_S = 1.0  #: s for the estimator to settle after a reset
MANIFEST_COLUMNS = ("file", "use", "fold", "height", "angle_deg", "wind", "speed_mps")
CLEAN_LOSS = 0.01  #: fraction of lost samples up to which a flight counts as clean


@dataclass(frozen=True)
class Plan:
    """The settings of one run of `collect`."""

    uri: str
    out: Path
    name: str
    vehicle: str = "crazyflie-2.1-flow"
    settings: Sequence[tuple[str, str]] = ()
    least_v: float = checks.LEAST_V
    link_timeout_s: float = LINK_TIMEOUT_S
    force: bool = False
    guarded: bool = True


@dataclass
class Outcome:
    """A recorded flight: its file, how it ended, and its log."""

    path: Path
    ended: str
    log: FlightLog
    silences: list[float] = field(default_factory=list)
    use: str = "messy"  #: its `use` in the manifest

    @property
    def planned(self) -> bool:
        """True if the mission was flown to its end."""
        return self.ended == "as planned"


@dataclass
class Readiness:
    """A drone that passed the checks: its condition, its slow log block and its firmware's revision."""

    condition: checks.Condition
    slow: blocks.Block | None
    firmware: str


def prepare_folder(out: Path, say: Callable[[str], None]) -> None:
    """Make the folder for flights, check its free space, and recover the flights of a killed run.

    Raises AirTouchError for a folder that cannot be made or written to, or that is too full.
    """
    try:
        out.mkdir(parents=True, exist_ok=True)
        free = shutil.disk_usage(out).free
    except OSError as error:
        raise AirTouchError(f"{out}: cannot make this folder: {error.strerror}") from None
    if not os.access(out, os.W_OK):
        raise AirTouchError(f"{out}: cannot be written to; choose another --out")
    if free < LEAST_FREE_BYTES:
        raise AirTouchError(f"{out}: {free / 2**20:.0f} MB of room left, "
                            f"{LEAST_FREE_BYTES / 2**20:.0f} are needed")
    recovered, unreadable = recover(out)
    for path in recovered:
        say(f"{path}: recovered from a flight whose process was killed")
    for line in unreadable:
        say(f"{line}: an unfinished flight that cannot be recovered; repair it or remove it")


def make_ready(drone: Drone, plan: Plan, say: Callable[[str], None]) -> Readiness:
    """Check log variables, block size, battery and decks; set parameters; start the log blocks. Nothing moves yet.

    A virtual drone is put back to its start. Raises AirTouchError with one line for each fault.
    """
    known = drone.variables
    blocks.check(blocks.MOTION, known)
    decks = {deck: there for deck in DECKS if (there := has_deck(drone, deck)) is not None}
    without = () if decks.get("bcMultiranger") else blocks.MULTIRANGER
    state = blocks.available(blocks.STATE, known, without)
    blocks.check(state, known)
    slow = state if state.variables else None
    for name, text in plan.settings:
        drone.set_parameter(name, text)
    start_over(drone)
    drone.start(blocks.MOTION)
    if slow:
        drone.start(slow)
    intake = listen(drone, slow, FIRST_DATA_S)
    condition = checks.Condition(intake.latest["vbat_V"], decks, intake.supervisor, intake.latest["zrange_m"])
    faults = checks.problems(condition, plan.least_v)
    if faults:
        for line in faults[:-1]:
            say(f"not ready: {line}")
        raise AirTouchError(f"not ready: {faults[-1]}")
    for line in checks.notes(condition):
        say(line)
    if drone.protocol < LINEAR_PROTOCOL:
        say("this firmware flies legs smoothly, not at constant speed; flash a newer one for sweeps")
    return Readiness(condition, slow, firmware(drone))


def has_deck(drone: Drone, deck: str) -> bool | None:
    """True if a deck is attached; None if the firmware does not know it. Raises AirTouchError without an answer."""
    if not drone.has_parameter(f"deck.{deck}"):
        return None
    value = drone.parameter(f"deck.{deck}", PARAMETERS_S)
    if value is None:
        raise AirTouchError(f"deck.{deck}: the drone does not tell its parameters; is the link good?")
    return bool(value)


def listen(drone: Drone, slow: blocks.Block | None, patience_s: float) -> Intake:
    """Receive packets until both log blocks have arrived, for `patience_s` at most.

    Raises AirTouchError if the fast block does not arrive.
    """
    drain(drone.samples)
    intake, until = Intake(slow), time.monotonic() + patience_s
    while time.monotonic() < until:
        intake.take(drain(drone.samples))
        if intake.complete:
            return intake
        time.sleep(0.02)
    if not intake.received:
        raise AirTouchError(f"the log block started, but no data came within {patience_s:g} s; "
                            "is the link good?")
    return intake


def firmware(drone: Drone) -> str:
    """The firmware's revision, with + if it was modified; "unknown" if the drone does not tell it."""
    first, second = (drone.parameter(f"firmware.revision{i}", 2.0) for i in (0, 1))
    if first is None or second is None:
        return "unknown"
    dirty = "+" if drone.parameter("firmware.modified", 2.0) else ""
    return f"{int(first):08x}{int(second):04x}{dirty}"


def start_over(drone: Drone) -> None:
    """Put a virtual drone back to its start. A real drone is left alone."""
    if drone.has_parameter(START_OVER):
        drone.set_parameter(START_OVER, "1")


def standing_still(drone: Drone, slow: blocks.Block | None) -> Intake:
    """Packets of the drone once it has landed. Raises AirTouchError if it still flies after LANDED_S."""
    until = time.monotonic() + LANDED_S
    while True:
        intake = listen(drone, slow, FIRST_DATA_S)
        if intake.supervisor is None or not intake.supervisor & FLYING:
            return intake
        if time.monotonic() > until:
            raise AirTouchError("not ready: the drone is still flying; land it, then start again")
        time.sleep(0.2)


def reset_estimator(drone: Drone) -> None:
    """Reset the position estimate to zero at this place, if the firmware has the parameter for it."""
    if drone.has_parameter("kalman.resetEstimation"):
        drone.set_parameter("kalman.resetEstimation", "1")
        time.sleep(0.1)
        drone.set_parameter("kalman.resetEstimation", "0")
        time.sleep(RESET_S)


def origin_of(latest: dict[str, float]) -> Origin:
    """Position and heading of the standing drone by its own estimate; 0 for values that it does not log."""
    values = [latest.get(name, math.nan) for name in ("x_m", "y_m", "z_m", "yaw_rad")]
    return Origin(*(v if math.isfinite(v) else 0.0 for v in values))


def fly(drone: Drone, ready: Readiness, mission: Mission, plan: Plan, number: int, *, stop: Event,
        say: Callable[[str], None], show: Callable[[Flight], None] = lambda _: None) -> Outcome:
    """Fly a mission once and record it.

    Raises AirTouchError if the drone is not ready or refuses a command, and if the file cannot be written.
    """
    start_over(drone)
    standing_still(drone, ready.slow)
    reset_estimator(drone)
    standing = listen(drone, ready.slow, FIRST_DATA_S)
    now = replace(ready.condition, vbat_v=standing.latest["vbat_V"], supervisor=standing.supervisor)
    faults = checks.problems(now, plan.least_v)
    if faults:
        raise AirTouchError(f"not ready: {faults[0]}")
    if standing.supervisor is not None and standing.supervisor & (CAN_BE_ARMED | ARMED) == CAN_BE_ARMED:
        drone.arm()
        time.sleep(ARMING_S)
    origin = origin_of(standing.latest)
    intake = Intake(ready.slow)
    path = recorder.flight_path(plan.out, plan.name, number)
    book = Recorder(path, intake.names, meta_of(drone, ready, mission, plan, number), plan.force)
    height = max((leg.z_m for leg in mission.legs), default=0.0)
    down_s = max(2.0, height / LANDING_MPS)
    watch = guarding(plan.uri, origin.z_m, down_s) if plan.guarded else nullcontext(None)
    ended = "an error"
    with watch as guard:
        flight = Flight(drone, Autopilot(mission.legs, origin), intake, book, stop, plan.link_timeout_s, show,
                        say)
        try:
            ended = flight.run()
        finally:
            if guard is not None:
                guard.landed = flight.landed
            log = book.finish(ended=ended, silences_s=flight.silences)
    outcome = Outcome(path, ended, log, flight.silences)
    if len(log):
        outcome.use = list_flight(path, log, ended == "as planned")
    if flight.pilot.refused:
        raise AirTouchError(flight.pilot.refused)
    return outcome


def meta_of(drone: Drone, ready: Readiness, mission: Mission, plan: Plan, number: int) -> dict[str, Any]:
    """The metadata of a flight that are known before take-off."""
    now = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
    held = {"period_s": blocks.STATE.period_ms / 1000.0, "longest_s": blocks.HELD_S} if ready.slow else {}
    return {
        "vehicle": plan.vehicle, "condition": dict(mission.values), "acc_frame": "body",
        "mission": mission.name, "speed_mps": mission.speed_mps, "flight": number,
        "firmware": ready.firmware, "protocol": drone.protocol,
        "decks": sorted(deck for deck, there in ready.condition.decks.items() if there), "uri": plan.uri,
        "started": now, "recorded_by": f"airtouch {__version__}", "held_columns": held, "warnings": [],
        "settings": [f"{name}={text}" for name, text in plan.settings],
    }


def list_flight(file: Path, log: FlightLog, planned: bool) -> str:
    """Add a flight to the manifest.csv of its folder, which `evaluate` reads. Returns its `use` there.

    "clean": ended as planned, with few lost samples, and crossed an edge. "free-air": the same without an edge.
    "messy": any other. The mission's values come from the log's metadata.
    """
    path, meta = file.parent / "manifest.csv", log.meta
    rows = []
    if path.is_file():
        with path.open(encoding="utf-8-sig", newline="") as handle:
            rows = [row for row in csv.DictReader(handle) if row.get("file") != file.name]
    total = len(log) + meta["lost_samples"]
    use = "messy"
    if planned and meta["lost_samples"] <= CLEAN_LOSS * total:
        use = "clean" if crossed_an_edge(log) else "free-air"
    values = meta.get("condition")
    values = values if isinstance(values, dict) else {}
    clearance = values.get("clearance")
    rows.append({"file": file.name, "use": use, "fold": int(meta.get("flight") or 0) % 5,
                 "height": f"{1000 * clearance:.0f}mm" if clearance is not None else "",
                 "angle_deg": values.get("angle", ""), "wind": values.get("wind", "none"),
                 "speed_mps": meta.get("speed_mps") or ""})
    text = io.StringIO()
    writer = csv.DictWriter(text, MANIFEST_COLUMNS, extrasaction="ignore", restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    write_bytes(text.getvalue().encode(), path, force=True)
    return use


def crossed_an_edge(log: FlightLog) -> bool:
    """True if the down range shows an edge, or if there is no down range."""
    return not log.has("zrange_m") or bool(true_edges(log))


def recover(folder: Path) -> tuple[list[Path], list[str]]:
    """As `recorder.recover`, and add each recovered flight to the manifest."""
    recovered, unreadable = recorder.recover(folder)
    for path in recovered:
        list_flight(path, logs.read(path), planned=False)
    return recovered, unreadable
