"""The gap's channels: what each is, and what a flight's residual is in them, sample by sample.

Replay view: specific force (3), angular acceleration (3), and the gyro's rates (3), judged below 0.3 Hz. "Torque" of a
channel is torque per moment of inertia, an angular acceleration, as its "force" is force per mass. Command view: the
controller's command (4), divided by the change of its spectrum that the effects in the model predict, so that a right
model leaves the spectrum of nominal flights.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from airtouch.gap.flights.flight import GROUND, PERIOD_S, Flight
from airtouch.gap.flights.missing import interpolate_missing
from airtouch.gap.loop.closed_loop import ClosedLoop
from airtouch.gap.workspace import Workspace
from airtouch.simulation import replay
from airtouch.simulation import signals as at
from airtouch.simulation.effects import Active
from airtouch.simulation.flight import prepare
from airtouch.simulation.plant import hover_speed
from airtouch.vehicle import Vehicle


@dataclass(frozen=True)
class Channel:
    """A channel of the gap: its name, unit, and the band in which it is judged, Hz."""

    name: str
    unit: str
    low_hz: float = 0.0
    high_hz: float = 50.0


#: Of the rates only what is slower than any turn that is flown says something of the gyro; commands are judged above
#: the high-pass of `loop.command_spectra`; both limits and the upper one of commands are chosen.
CHANNELS = (
    *(Channel(f"force_{a}", "m/s^2") for a in "xyz"),
    *(Channel(f"torque_{a}", "rad/s^2") for a in "xyz"),
    *(Channel(f"rate_{a}", "rad/s", 0.0, 0.3) for a in "xyz"),
    Channel("command_thrust", "N", 0.6, 30.0),
    *(Channel(f"command_{a}", "N", 0.6, 30.0) for a in ("roll", "pitch", "yaw")),
)
COLUMN = {c.name: i for i, c in enumerate(CHANNELS)}  #: of each channel, by its name
#: each channel as a phrase, for notes, tables and pages
CHANNEL_WORDS = {
    "force_x": "forward force", "force_y": "sideways force", "force_z": "lift",
    "torque_x": "roll torque", "torque_y": "pitch torque", "torque_z": "yaw torque",
    "rate_x": "roll rate", "rate_y": "pitch rate", "rate_z": "yaw rate",
    "command_thrust": "thrust command", "command_roll": "roll command",
    "command_pitch": "pitch command", "command_yaw": "yaw command",
}
FORCE, TORQUE, RATE, COMMAND = slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 13)
COUNT = len(CHANNELS)  #: of a table with a column for each channel
#: s in which a passing effect sets in, and ceases: a vehicle at 0.4 m/s flies in or out of a wake that is 0.1 m wide.
#: Chosen among 0, 0.1, 0.2, 0.3 and 0.45 on wakes of recorded flights (host/docs/looks.md, 2026-11-28 21:12)
ONSET_S = 0.3
KEPT_RESIDUALS = 12  #: residuals of one flight that are cached for gates to be put together from; chosen


def inside(gate: Sequence[tuple[str, float, float]], flight: Flight) -> np.ndarray:
    """Samples (n,) of a flight within the stretches (flight, from_s, to_s) of a gate."""
    t = np.arange(len(flight)) * PERIOD_S
    out = np.zeros(len(flight), bool)
    for name, begin, end in gate:
        out |= (name == flight.name) & (t >= begin) & (t < end)
    return out


def share_inside(gate: Sequence[tuple[str, float, float]], flight: Flight) -> np.ndarray:
    """Share (n,), 0 to 1, with which an effect in a gate acts at the samples of a flight.

    At the ends of a stretch it is one half. It rises and falls along half a cosine that lasts ONSET_S.
    """
    t = np.arange(len(flight)) * PERIOD_S
    out = np.zeros(len(flight))
    for name, begin, end in gate:
        if name == flight.name:
            within = np.clip(np.minimum(t - begin, end - t) / ONSET_S + 0.5, 0.0, 1.0)
            out = np.maximum(out, 0.5 - 0.5 * np.cos(np.pi * within))
    return out


def residual(flight: Flight, vehicle: Vehicle, active: Sequence[Active] = (),
             loop: ClosedLoop | None = None, seed: int = 0) -> np.ndarray:
    """What a flight has beyond the model, (n, COUNT), in the channels' units; NaN in channels that it cannot have.

    - force and torque: measured minus modelled, where the logged commands drive the model;
    - rates: measured minus the bias of the gyro that the model has;
    - commands: as logged, over the ratio by which the effects change their spectra (`ClosedLoop.commands_without`).

    active: effects that the model has; loop: makes the commands, which are NaN without it; seed: of the noise that
    effects draw. In the phase GROUND the model is a vehicle at rest, whether the motors run or
    not: samples there with running motors are never usable (`contact.near_ground`). Without a gyro the angular
    acceleration is taken as zero, which holds at low frequency (the floor says how low).
    """
    return ReplayedFlight(flight, vehicle, loop, seed).residual(active)


@dataclass(frozen=True, eq=False)
class ReplayedFlight:
    """A flight beside the model of its vehicle, for its residual under one hypothesis after another.

    vehicle, loop, seed: see the function `residual`. Residuals that gates are put together from are cached by effects;
    whatever else they depend on belongs to the object.
    """

    flight: Flight
    vehicle: Vehicle
    loop: ClosedLoop | None = None
    seed: int = 0
    workspace: Workspace = field(default_factory=Workspace, init=False, repr=False)

    def residual(self, active: Sequence[Active] = ()) -> np.ndarray:
        """The function `residual`, as a new array.

        A passing effect adds in its seconds what it adds there when it always acts, times `share_inside`.
        """
        gated, always = [a for a in active if a.gate], [a for a in active if not a.gate]
        if not gated:
            return self._ungated(active)
        out = self._cached(always).copy()
        for a in gated:
            share = share_inside(a.gate, self.flight)
            acts = share > 0.0
            if acts.any():
                added = self._cached([*always, replace(a, gate=())])[acts] - self._cached(always)[acts]
                out[acts] += share[acts, None] * added
        return out

    def _cached(self, active: Sequence[Active]) -> np.ndarray:
        """Residual of effects that always act, cached; not to be changed."""
        return self.workspace.cached("residual", tuple(a.key for a in active), lambda: self._ungated(active),
                                     KEPT_RESIDUALS)

    def _ungated(self, active: Sequence[Active]) -> np.ndarray:
        """Residual of effects that always act."""
        flight, out = self.flight, np.full((len(self.flight), COUNT), np.nan)
        plant = prepare(self.vehicle, active)[0]
        row = plant[0]
        # the replay writes to them, always to the same columns: one copy serves every hypothesis
        signals = self.workspace.cached("signals", (), flight.signals.copy)
        signals[:, at.MASS], signals[:, at.HOVER_SPEED] = row["mass"], hover_speed(plant)
        signals[:, at.ROTOR_X:at.ROTOR_X + 4] = row["rotor_x"] - row["com"][0]
        signals[:, at.ROTOR_Y:at.ROTOR_Y + 4] = row["rotor_y"] - row["com"][1]
        model = replay.run(flight.log, self.vehicle, active, period_s=PERIOD_S, signals=signals, pwm=flight.pwm,
                           seed=self.seed)
        force, turning = model.specific_force, model.angular_acceleration
        # measured is a difference between two samples, the mean acceleration between them: so is the modelled one
        turning = 0.5 * (turning + np.concatenate([turning[1:], turning[-1:]]))
        rest = flight.phase == GROUND
        force[rest] = flight.body_to_world[rest, 2, :] * self.vehicle.gravity_mps2 + row["acc_bias"]
        turning[rest] = 0.0
        out[:, FORCE] = flight.acceleration - force
        out[:, TORQUE] = angular_acceleration(flight) - turning
        if flight.rates is not None:
            out[-1, TORQUE] = 0.0  # no sample follows the last one, so that it has no measured acceleration
            out[:, RATE] = flight.rates - row["gyro_bias"]
        if self.loop is not None:
            out[:, COMMAND] = self.loop.commands_without(flight, active)
        return out


def angular_acceleration(flight: Flight) -> np.ndarray:
    """Differences of the gyro (n, 3), rad/s^2; zero where there is none, which holds at low frequency.

    It is cached, and not to be changed.
    """
    def make() -> np.ndarray:
        """Differences to the next sample, straight lines over those that bridge lost rows.

        The row before a gap keeps the slope across it, which is the mean over the gap and itself: nearer to the truth
        there (1.3 rad/s^2 rms in roll) than a line from the row before (2.2), in simulated flights with runs of 4 lost
        rows.
        """
        out = np.zeros((len(flight), 3))
        if flight.rates is not None:
            out[:-1] = np.diff(flight.rates, axis=0) / PERIOD_S
        return interpolate_missing(np.where(flight.bridged[:, None], np.nan, out))

    return flight.workspace.cached("turning", (), make)
