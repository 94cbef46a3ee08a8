"""One flight: receive packets, write rows to the file, send commands, and land early when something is wrong."""

import contextlib
import queue
import statistics
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from threading import Event
from typing import Protocol

from airtouch.crazyflie.autopilot import BUSY, FLYING_S, Autopilot
from airtouch.crazyflie.checks import CONFLICTS, LOWEST_V
from airtouch.crazyflie.connection.commands import Command
from airtouch.crazyflie.connection.drone import drain
from airtouch.crazyflie.connection.intake import Intake
from airtouch.crazyflie.connection.log_blocks import Sample
from airtouch.crazyflie.connection.ticks import Restarted, host_clock_s
from airtouch.crazyflie.readiness import FLYING
from airtouch.crazyflie.recorder import Recorder
from airtouch.errors import AirTouchError

TURN_S = 0.02  #: s, period of the loop
PING_S = 0.5  #: s between echo requests, which keep a quiet link open
LINK_TIMEOUT_S = 3.0  #: s of silence, after which the drone lands as soon as the link is back
FORGOTTEN_S = 1.0  #: s of silence, after which the firmware has deleted the log blocks
GIVE_UP_S = 60.0  #: s without an answer to the land command, after which the flight gives up
SILENCE_S = 0.5  #: s without a packet that the flight notes; chosen
LAND_TRIES, LAND_WAIT_S = 50, 0.1  #: land commands after an error, and s to wait for the answer to each; chosen
STOP_EVERY_S = 5 * TURN_S  #: s between two "stop" commands after a flight; chosen
AFTER_S = 0.5  #: s of log after the motors have stopped
BATTERY_SAMPLES = 100  #: samples (1 s) whose median voltage counts, so that a climb does not end the flight


class Craft(Protocol):
    """The interface of a drone that a flight needs. `drone.Drone` has it."""

    @property
    def samples(self) -> "queue.SimpleQueue[Sample]":
        """Received log packets."""

    @property
    def answers(self) -> "queue.SimpleQueue[tuple[str, int]]":
        """The drone's answers: kind of command and error code, 0 for accepted."""

    @property
    def lost(self) -> Event:
        """Set when the link is lost."""

    def send(self, commands: list[Command]) -> None:
        """Send commands."""

    def ping(self) -> None:
        """Request an echo."""

    def reopen(self, patience_s: float) -> None:
        """Connect again. Raises AirTouchError if that fails."""

    def revive(self) -> None:
        """Request the log blocks again; the drone may have deleted them."""


@dataclass
class Flight:
    """One flight. `run` flies it and returns how it ended. On any error it lands the drone first.

    stop: set it to land (Ctrl-C). show: called with the flight in every turn of the loop. in_air: called with True
    before each command in the air, and with False once the drone stands.
    """

    craft: Craft
    pilot: Autopilot
    intake: Intake
    recorder: Recorder
    stop: Event = field(default_factory=Event)
    link_timeout_s: float = LINK_TIMEOUT_S
    show: Callable[["Flight"], None] = lambda _: None
    say: Callable[[str], None] = lambda _: None
    clock: Callable[[], float] = field(default_factory=lambda: host_clock_s)
    sleep: Callable[[float], None] = field(default_factory=lambda: time.sleep)
    in_air: Callable[[bool], None] = lambda _: None
    silences: list[float] = field(default_factory=list)
    landed: bool = False
    _volts: deque = field(default_factory=lambda: deque(maxlen=BATTERY_SAMPLES))
    _silent_since: float | None = None
    _began: float = 0.0
    _last_ping: float = 0.0
    _landing_since: float | None = None
    _restarted_s: float | None = None  #: host's clock when the drone's started again, until it says whether it flies
    _logs: bool = True

    def run(self) -> str:
        """Fly to the end. Returns "as planned", or the reason of an early landing."""
        self._began = self.clock()
        try:
            while self.pilot.phase != "done":
                ended = self._turn(self.clock())
                if ended:
                    return ended
                with contextlib.suppress(OSError):  # the terminal may be gone
                    self.show(self)
                self.sleep(TURN_S)
            self._tail()
            return self._over(self.pilot.reason)
        except BaseException:
            self._bring_down()
            raise

    def _turn(self, wall: float) -> str | None:
        """One turn of the loop at `wall` (s): packets in, link, commands out. Returns how the flight ended, if it did.

        The order matters: a reason to land is found before the autopilot's step, so that the landing is in it, and
        the link is repaired before anything is sent.
        """
        self._receive()
        silence = self._silence(wall)
        if self._restarted_s is not None and not self._flies_on():
            self._repair_link(silence)
            self._ping(wall)
            return self._after_restart(wall)
        self.pilot.flying = self._flying()
        for kind, code in drain(self.craft.answers):
            self.pilot.answer(kind, code)
        self._land_early(silence)
        if self.pilot.phase == "landing" and self._landing_since is None:  # also after a command that was refused
            self._landing_since = wall
        self._repair_link(silence)
        self._send(self.pilot.step(self._now(silence), wall, silence))
        self._ping(wall)
        lands = not self.pilot.waiting and not self.pilot.flies_on
        if self._landing_since is not None and not lands and wall - self._landing_since > GIVE_UP_S:
            hears = self.pilot.flies_on and silence < SILENCE_S
            what = "IT FLIES ON after land commands" if hears else "NO CONTACT"
            return f"{self.pilot.reason}; {what} for {GIVE_UP_S:.0f} s, land by hand"
        return None

    def _flying(self) -> bool | None:
        """Whether the drone says that it flies; None if it does not say."""
        return None if self.intake.supervisor is None else bool(self.intake.supervisor & FLYING)

    def _flies_on(self) -> bool:
        """True if a drone whose clock started again says that it flies; it then lands.

        Only its own word counts: a landing that is sent to a drone that fell would spin its motors.
        """
        if not self.pilot.in_air or not self._flying():
            return False
        self._restarted_s = None
        self._land_for("the drone's clock jumped")
        return True

    def _after_restart(self, wall: float) -> str | None:
        """How the flight ended after a restart; None while the drone has not said yet whether it flies.

        Without its word the guard stays armed. Firmware that never says it counts as restarted.
        """
        says = self.intake.slow is not None and "supervisor.info" in self.intake.slow.names
        if not self.pilot.in_air or not says or self.intake.supervisor is not None:
            return self._over("the drone restarted in flight")
        if wall - (self._restarted_s or wall) > self.link_timeout_s:
            return "the drone's clock jumped, and it does not tell whether it flies; land it by hand"
        return None

    def _send(self, commands: list[Command]) -> None:
        """Send the autopilot's commands. The guard learns of a take-off before it, and of a landing after it."""
        if self.pilot.in_air:
            self.in_air(True)
        self.craft.send(commands)
        if not self.pilot.in_air:
            self.in_air(False)

    def _land_early(self, silence: float) -> None:
        """Turn the mission into a landing where there is a reason to land."""
        reason = self._reason(silence)
        if reason:
            self._land_for(reason)

    def _land_for(self, reason: str) -> None:
        if self.pilot.phase == "mission":
            self._tell(f"{reason}: landing")
            self.pilot.land(reason)

    def _repair_link(self, silence: float) -> None:
        """Connect again to a lost drone; request the log blocks again that a silent one has deleted."""
        if self.craft.lost.is_set():
            self._reconnect()
        elif silence > FORGOTTEN_S:
            self.craft.revive()

    def _ping(self, wall: float) -> None:
        if wall - self._last_ping > PING_S:
            self.craft.ping()
            self._last_ping = wall

    def _tell(self, text: str) -> None:
        """Print a line. A closed terminal must not end the flight."""
        with contextlib.suppress(OSError):
            self.say(text)

    def _over(self, reason: str | None) -> str:
        self._on_the_ground()
        return reason or "as planned"

    def _on_the_ground(self) -> None:
        self.landed = True
        self.in_air(False)

    def _receive(self) -> None:
        """Handle the received packets. The log ends where the drone's clock starts again."""
        try:
            times, columns = self.intake.take(drain(self.craft.samples))
        except Restarted:
            self.intake = Intake(self.intake.slow, last_arrival_s=self.intake.last_arrival_s)
            self._restarted_s, self._logs = self.clock(), False
            return
        if len(times) and self._logs:
            self.recorder.add(times, columns)
        if len(times):
            self._volts.extend(columns["vbat_V"])

    def _silence(self, wall: float) -> float:
        """Seconds since the last packet, or since the flight began; notes each silence of over SILENCE_S."""
        heard = self.intake.last_arrival_s
        silence = wall - (self._began if heard is None else max(heard, self._began))
        if silence > SILENCE_S and self._silent_since is None:
            self._silent_since = wall - silence
        elif silence < SILENCE_S and self._silent_since is not None:
            self.silences.append(round(wall - self._silent_since, 2))
            self._tell(f"the drone is heard again after {self.silences[-1]:.1f} s of silence")
            self._silent_since = None
        return silence

    def _now(self, silence: float) -> float:
        """The drone's clock in s, extrapolated during silence."""
        return (self.intake.newest_ms or 0) / 1000.0 + max(silence, 0.0)

    def _reason(self, silence: float) -> str | None:
        """The reason to land now; None without one."""
        if self.stop.is_set():
            return "stopped by the user"
        if self.recorder.error:
            return f"the log cannot be written ({self.recorder.error})"
        if silence > self.link_timeout_s or self.craft.lost.is_set():
            return f"link lost for {silence:.1f} s"
        if len(self._volts) == BATTERY_SAMPLES and statistics.median(self._volts) < LOWEST_V:
            return f"battery at {statistics.median(self._volts):.2f} V"
        if self.pilot.in_air and self.intake.supervisor is not None:
            bad = [what for what, bit in CONFLICTS.items() if self.intake.supervisor >> bit & 1]
            if bad:
                return f"the drone {bad[0]}"
        return None

    def _reconnect(self) -> None:
        """Connect again. Raises AirTouchError after GIVE_UP_S without contact."""
        self._tell("the link broke; connecting anew")
        try:
            self.craft.reopen(GIVE_UP_S)
        except AirTouchError as error:
            self._tell(f"{error}: the drone hovers where its leg ended; land it by hand")
            self.pilot.phase = "done"
            self.pilot.reason = f"{self.pilot.reason}; NO CONTACT, land by hand"
            raise

    def _tail(self) -> None:
        """Log for AFTER_S more, and send "stop" again in case it was lost."""
        until = self.clock() + AFTER_S
        while self.clock() < until:
            self._receive()
            self.craft.send([Command("stop")])
            self.sleep(STOP_EVERY_S)
        self._receive()

    def _bring_down(self) -> None:
        """Land after an error in this program, before the error is reported."""
        if not self.pilot.in_air:
            self._on_the_ground()
            return
        self._tell("an error in flight: landing")
        command = self.pilot.landing_command()
        for tried in range(LAND_TRIES):
            try:
                self.craft.send([command])
                self.sleep(LAND_WAIT_S)
                codes = [code for kind, code in drain(self.craft.answers) if kind == "land"]
                accepted = 0 in codes or not self._flying()
                if not codes or not (accepted or (tried and BUSY not in codes)):
                    continue
                if not accepted:  # it may be landing since an earlier command, whose answer was lost
                    self.sleep(command.seconds + FLYING_S)
                    self.intake.take(drain(self.craft.samples))
                    if self._flying():
                        return
                self._on_the_ground()
                self.sleep(command.seconds + 1.0 if accepted else 0.0)
                self.craft.send([Command("stop")])
                return
            except Exception:  # the guard process lands the drone when this one ends
                return
