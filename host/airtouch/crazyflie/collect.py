"""`collect`: from a connected drone to flights on the disk.

readiness   checks before take-off, log blocks, arming      flight    one flight, and early landings
recorder    its file                                        manifest  its row in manifest.csv
"""

import datetime
import os
import shutil
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from threading import Event
from typing import Any

from airtouch import __version__
from airtouch.crazyflie import checks, manifest
from airtouch.crazyflie.autopilot import Autopilot
from airtouch.crazyflie.connection import blocks
from airtouch.crazyflie.connection.drone import Drone
from airtouch.crazyflie.connection.intake import Intake
from airtouch.crazyflie.flight import LINK_TIMEOUT_S, Flight
from airtouch.crazyflie.guard import guarding
from airtouch.crazyflie.mission import Mission, landing_seconds
from airtouch.crazyflie.readiness import Readiness, origin_of, settle
from airtouch.crazyflie.recorder import LEAST_FREE_BYTES, Recorder, flight_path
from airtouch.errors import AirTouchError
from airtouch.logs.files import MANIFEST
from airtouch.logs.flight_log import FlightLog
from airtouch.vehicle import DEFAULT_VEHICLE


@dataclass(frozen=True)
class Plan:
    """The settings of one run of `collect`."""

    uri: str
    out: Path
    name: str
    vehicle: str = DEFAULT_VEHICLE
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


def prepare_folder(out: Path, say: Callable[[str], None]) -> None:
    """Make the folder for flights, check its free space and manifest, and recover the flights of a killed run.

    Raises AirTouchError for a folder that cannot be made or written to, or that is too full, and for a manifest to
    which no flight can be added.
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
    manifest.read(out / MANIFEST)
    recovered, unreadable = manifest.recover(out)
    for path in recovered:
        say(f"{path}: recovered from a flight whose process was killed")
    for line in unreadable:
        say(f"{line}: an unfinished flight that cannot be recovered; repair it or remove it")


def fly(drone: Drone, ready: Readiness, mission: Mission, plan: Plan, number: int, *, stop: Event,
        say: Callable[[str], None], show: Callable[[Flight], None] = lambda _: None) -> Outcome:
    """Fly a mission once, record it, and add it to the manifest.

    Raises AirTouchError if the drone is not ready or refuses a command, if the file cannot be written, and after `stop`
    before the drone is armed.
    """
    intake = Intake(ready.slow)
    path = flight_path(plan.out, plan.name, number)
    recorder = Recorder(path, intake.names, meta_of(drone, ready, mission, plan, number), plan.force)
    down_s = landing_seconds(max((leg.z_m for leg in mission.legs), default=0.0))
    outcome = Outcome(path, "an error", recorder.log())
    try:
        origin = origin_of(settle(drone, ready, plan.least_v, stop).latest)
        with guarding(plan.uri, origin.z_m, down_s) if plan.guarded else nullcontext(None) as guard:
            flight = Flight(drone, Autopilot(mission.legs, origin), intake, recorder, stop, plan.link_timeout_s, show,
                            say, silences=outcome.silences, in_air=guard.tell if guard else lambda _: None)
            outcome.ended = flight.run()
    finally:
        outcome.log = recorder.finish(ended=outcome.ended, silences_s=outcome.silences)
        if len(outcome.log):
            outcome.use = manifest.list_flight(path, outcome.log, outcome.planned)
    if flight.pilot.refused:
        raise AirTouchError(flight.pilot.refused)
    return outcome


def meta_of(drone: Drone, ready: Readiness, mission: Mission, plan: Plan, number: int) -> dict[str, Any]:
    """The metadata of a flight that are known before take-off."""
    now = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
    hold = {"period_s": blocks.STATE.period_ms / 1000.0, "longest_s": blocks.HELD_S} if ready.slow else {}
    return {
        "vehicle": plan.vehicle, "condition": dict(mission.values), "acc_frame": "body",
        "mission": mission.name, "speed_mps": mission.speed_mps, "flight": number,
        "firmware": ready.firmware, "protocol": drone.protocol,
        "decks": sorted(deck for deck, there in ready.condition.decks.items() if there), "uri": plan.uri,
        "started": now, "recorded_by": f"airtouch {__version__}", "held_columns": hold, "warnings": [],
        "settings": [f"{name}={text}" for name, text in plan.settings],
    }
