"""The commands of a mission and when to send them: a state machine without threads and without a radio.

The firmware answers every command of the high-level commander; a command without an answer is sent again.
While the link is silent the firmware finishes its leg and hovers. Nothing is sent to a drone that was not heard for
SILENT_S: it may have restarted, and a landing would spin its motors. A stop lands it as soon as it is heard again.
A landing that was not accepted is over when the drone no longer says that it flies, where it says so.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from airtouch.crazyflie.connection.commands import Command
from airtouch.crazyflie.mission import Leg, landing_seconds

RESEND_S = 0.3  #: s without an answer, after which a command is sent again
SILENT_S = 1.0  #: s without a packet, after which nothing is sent until one comes; chosen
TRIES = 8  #: times that a command is sent; after that it counts as accepted if log packets still arrive
LATE_S = 1.0  #: s after which an answer that has not come counts as lost; assumed
SETTLE_S = 1.0  #: s from the end of a landing to the stop of the motors
FLYING_S = 3.0  #: s from the end of a landing to the next; for 2 s after its motors stop the firmware says "flying"
BUSY = 16  #: the firmware's EBUSY: the supervisor does not let it fly


@dataclass(frozen=True)
class Origin:
    """Position and heading of the drone before take-off, by its own estimate."""

    x_m: float = 0.0
    y_m: float = 0.0
    z_m: float = 0.0
    yaw_rad: float = 0.0


@dataclass
class Autopilot:
    """Flies the legs of a mission. Call `step` often; it returns the commands to send.

    phase: mission, landing or done. refused: why the drone refused a command, else None.
    reason: why it landed early, else None. flying: whether the drone says that it flies; None if it does not say.
    """

    legs: Sequence[Leg]
    origin: Origin = field(default_factory=Origin)
    phase: str = "mission"
    reason: str | None = None
    refused: str | None = None
    index: int = -1
    in_air: bool = False
    flying: bool | None = None
    _command: Command | None = None
    _answered: bool = True
    _accepted: bool = False  #: answered with code 0
    _tries: int = 0
    _sent_s: float = -math.inf
    _until_s: float = -math.inf
    _wall_sent_s: float = -math.inf
    _unanswered_s: list[float] = field(default_factory=list)  #: host's clock, sends of this kind without an answer

    @property
    def leg(self) -> Leg | None:
        """The current leg."""
        return self.legs[self.index] if 0 <= self.index < len(self.legs) else None

    @property
    def waiting(self) -> bool:
        """True if the last command has not been answered yet."""
        return not self._answered

    @property
    def flies_on(self) -> bool:
        """True if the drone says that it flies, and the last command was a landing that it has not accepted."""
        lands = self._command is not None and self._command.kind == "land"
        return lands and self.in_air and not self._accepted and bool(self.flying)

    def answer(self, kind: str, code: int) -> None:
        """Handle the drone's answer to a command: its kind and an error code, 0 for accepted.

        An answer names only the kind of its command. Answers come in the order of the commands, so as many as
        earlier commands of this kind are owed are ignored. One that is lost (LATE_S) is not waited for; where it was
        counted all the same, the command is sent once more than necessary.
        """
        if self._command is None or kind != self._command.kind:
            return
        if self._unanswered_s:
            self._unanswered_s.pop(0)
        if self._answered or len(self._unanswered_s) >= self._tries:
            return
        repeated = self._tries > 1  # the first may have been accepted and its answer lost
        if code == 0 or (repeated and code != BUSY) or (self.phase == "landing" and not self.flying):
            self._answered, self._accepted = True, code == 0
            return
        if self.phase == "landing":
            return
        self.refused = f"the drone refused {kind} (code {code}); restart it"
        if code == BUSY:
            self.refused = (f"the drone's supervisor refuses {kind}: it is not ready to fly; "
                            "put it upright and restart it")
        self.in_air = self.in_air and kind != "take-off"
        self.land(self.refused)

    def land(self, reason: str | None) -> None:
        """Stop the mission and land. On the ground the mission just ends."""
        if self.phase != "mission":
            return
        self.reason = reason
        if not self.in_air:
            self.phase = "done"
            return
        self.phase, self._command, self._answered = "landing", None, False
        self._until_s = -math.inf

    def step(self, now_s: float, wall_s: float, silence_s: float = 0.0) -> list[Command]:
        """The commands to send now. now_s: drone's clock; wall_s: host's; silence_s: since the last packet."""
        if self.phase == "done":
            return []
        lands = self.phase == "landing" and self._command is not None and self._answered and not self.flies_on
        if silence_s > SILENT_S and not lands:
            return []
        if self._command is not None and not self._answered:
            return self._again(now_s, wall_s, silence_s)
        if now_s < self._until_s:
            return []
        if self.flies_on and now_s < self._until_s + FLYING_S:
            return []
        if self.flies_on:
            self.land("the drone flies on after its landing")
            return self._send(self.landing_command(), now_s, wall_s)
        if self.phase == "landing":
            return self._come_down(now_s, wall_s)
        self.index += 1
        if self.index >= len(self.legs):
            landed, self.phase, self.in_air = self.in_air, "done", False
            return [Command("stop")] if landed else []
        leg = self.legs[self.index]
        if leg.kind in ("wait", "hover"):
            landed = leg.kind == "wait" and self.in_air
            self.in_air = self.in_air and leg.kind != "wait"
            self._until_s = max(now_s, self._until_s if math.isfinite(self._until_s) else now_s) + leg.seconds
            return [Command("stop")] if landed else []
        self.in_air = True
        return self._send(self._command_of(leg), now_s, wall_s)

    def _come_down(self, now_s: float, wall_s: float) -> list[Command]:
        if self._command is not None:  # answered, and its duration is over
            self.phase, self.in_air = "done", False
            return [Command("stop")]
        return self._send(self.landing_command(), now_s, wall_s)

    def landing_command(self) -> Command:
        """The command to land from anywhere on the legs so far, slow enough for the highest of them."""
        height = max((leg.z_m for leg in self.legs[:self.index + 1]), default=0.0)
        return Command("land", z_m=self.origin.z_m, seconds=landing_seconds(height))

    def _send(self, command: Command, now_s: float, wall_s: float) -> list[Command]:
        same = self._command is not None and self._command.kind == command.kind
        owed = [sent_s for sent_s in self._unanswered_s if same and wall_s - sent_s < LATE_S]
        self._unanswered_s = [*owed, wall_s]
        self._command, self._answered, self._accepted, self._tries = command, False, False, 1
        self._sent_s, self._wall_sent_s = now_s, wall_s
        rest = SETTLE_S if command.kind == "land" else 0.0
        self._until_s = now_s + command.seconds + rest
        return [command]

    def _again(self, now_s: float, wall_s: float, silence_s: float) -> list[Command]:
        if self._command is None or wall_s - self._wall_sent_s < RESEND_S:
            return []
        if self._tries >= TRIES and silence_s < RESEND_S:
            self._answered = True
            return []
        tries = self._tries + 1
        sent = self._send(self._command, now_s, wall_s)
        self._tries = tries
        return sent

    def _command_of(self, leg: Leg) -> Command:
        o = self.origin
        cos, sin = math.cos(o.yaw_rad), math.sin(o.yaw_rad)
        return Command(leg.kind, o.x_m + cos * leg.x_m - sin * leg.y_m, o.y_m + sin * leg.x_m + cos * leg.y_m,
                       o.z_m + leg.z_m, o.yaw_rad, leg.seconds)
