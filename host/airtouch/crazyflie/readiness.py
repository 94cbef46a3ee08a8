"""A drone on the ground: checked, its log blocks started, landed and reset before each flight."""

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from threading import Event

from airtouch.crazyflie import checks
from airtouch.crazyflie.autopilot import Origin
from airtouch.crazyflie.connection import blocks
from airtouch.crazyflie.connection.drone import Drone, drain
from airtouch.crazyflie.connection.intake import Intake
from airtouch.errors import AirTouchError

DECKS = ("bcFlow2", "bcFlow", "bcMultiranger", "bcAI", "bcZRanger2", "bcLighthouse4", "bcLoco")
FIRST_DATA_S = 3.0  #: s to wait for the first packets; with an empty radio queue they take less than 0.1 s
PARAMETERS_S = 30.0  #: s to wait for a parameter; cflib fetches them all, one after the other
LINEAR_PROTOCOL = 8  #: lowest protocol version in which go-to can fly at constant speed
CAN_BE_ARMED, ARMED, FLYING = 1, 2, 16  #: bits of the firmware's `supervisor.info`
LANDED_S = 15.0  #: s to wait for a drone that is still landing after a killed flight
START_OVER = "sitl.startOver"  #: parameter that only a virtual drone has
ARMING_S = 1.0  #: s from arming to the first command; brushless motors spin up in this time
RESET_S = 1.0  #: s for the estimator to settle after a reset


@dataclass
class Readiness:
    """A drone that passed the checks: its condition, its slow log block and its firmware's revision."""

    condition: checks.Condition
    slow: blocks.Block | None
    firmware: str


def make_ready(drone: Drone, settings: Sequence[tuple[str, str]], least_v: float,
               say: Callable[[str], None]) -> Readiness:
    """Check log variables, block size, battery and decks; set parameters; start the log blocks. Nothing moves yet.

    settings: names and values of parameters. least_v: V. A virtual drone is put back to its start.
    Raises AirTouchError with one line for each fault.
    """
    blocks.check(blocks.MOTION, drone.variables)
    decks = {deck: there for deck in DECKS if (there := has_deck(drone, deck)) is not None}
    slow = slow_block(drone, decks)
    for name, text in settings:
        drone.set_parameter(name, text)
    start_over(drone)
    drone.start(blocks.MOTION)
    if slow:
        drone.start(slow)
    intake = listen(drone, slow, FIRST_DATA_S)
    condition = checks.Condition(intake.latest["vbat_V"], decks, intake.supervisor, intake.latest["zrange_m"])
    faults = checks.problems(condition, least_v)
    for line in faults[:-1]:
        say(f"not ready: {line}")
    if faults:
        raise AirTouchError(f"not ready: {faults[-1]}")
    for line in checks.notes(condition):
        say(line)
    if drone.protocol < LINEAR_PROTOCOL:
        say("this firmware flies legs smoothly, not at constant speed; flash a newer one for sweeps")
    return Readiness(condition, slow, firmware(drone))


def settle(drone: Drone, ready: Readiness, least_v: float, stop: Event) -> Intake:
    """Wait for the drone to stand still, reset its estimate, check it again, and arm it. Returns its packets.

    least_v: V. stop: set it to leave the drone unarmed. Raises AirTouchError if it is not ready, and after `stop`.
    """
    go_on(stop)
    start_over(drone)
    standing_still(drone, ready.slow)
    reset_estimator(drone)
    standing = listen(drone, ready.slow, FIRST_DATA_S)
    now = replace(ready.condition, vbat_v=standing.latest["vbat_V"], supervisor=standing.supervisor,
                  zrange_m=standing.latest["zrange_m"])
    faults = checks.problems(now, least_v)
    if faults:
        raise AirTouchError(f"not ready: {faults[0]}")
    go_on(stop)
    if standing.supervisor is not None and standing.supervisor & (CAN_BE_ARMED | ARMED) == CAN_BE_ARMED:
        drone.arm()
        time.sleep(ARMING_S)
    return standing


def go_on(stop: Event) -> None:
    """Raise AirTouchError if `stop` is set."""
    if stop.is_set():
        raise AirTouchError("stopped by the user before the take-off")


def slow_block(drone: Drone, decks: Mapping[str, bool]) -> blocks.Block | None:
    """The slow log block with the variables that the drone has; None without any."""
    without = () if decks.get("bcMultiranger") else blocks.MULTIRANGER
    block = blocks.available(blocks.STATE, drone.variables, without)
    blocks.check(block, drone.variables)
    return block if block.variables else None


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
        drone.trigger(START_OVER)


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
        drone.trigger("kalman.resetEstimation")  # estimatorKalmanTask clears it within a millisecond
        time.sleep(RESET_S)


def origin_of(latest: dict[str, float]) -> Origin:
    """Position and heading of the standing drone by its own estimate; 0 for values that it does not log."""
    values = [latest.get(name, math.nan) for name in ("x_m", "y_m", "z_m", "yaw_rad")]
    return Origin(*(v if math.isfinite(v) else 0.0 for v in values))
