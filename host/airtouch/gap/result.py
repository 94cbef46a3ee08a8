"""What a diagnosis says, and its JSON form (the fixed interface of `airtouch gap diagnose --json`)."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple, TypedDict

import numpy as np

from airtouch.gap.where.cell import Cell, GapMap, plain_cell

if TYPE_CHECKING:  # which import this module
    from airtouch.gap.answer.curves import Curves
    from airtouch.gap.nominal.calibrate import Calibration
    from airtouch.gap.study import Study
    from airtouch.vehicle import Vehicle


@dataclass(frozen=True)
class Quantity:
    """A number with its 90 % interval and unit; low and high None where there is none."""

    value: float
    low: float | None = None
    high: float | None = None
    unit: str = "1"

    def plain(self) -> dict[str, Any]:
        """JSON-ready, without the ends of an interval that there is not."""
        return {k: v for k, v in asdict(self).items() if v is not None}


@dataclass(frozen=True)
class Closure:
    """Gap before and after effects are in the model, in units of the floor.

    shrink: fraction of the gap above the floor that they close; of a jitter without an interval.
    """

    before: float
    after: float
    shrink: Quantity

    def plain(self) -> dict[str, Any]:
        """JSON-ready."""
        return {"before": self.before, "after": self.after, "shrink": self.shrink.plain()}


class OverallGap(TypedDict, total=False):
    """Gap of the whole flights: rms over the floor's, without unit; empty where it is not known.

    `Diagnosis.judged_on` says on what data. They are those that the effects were fitted to where one passing effect
    alone is named, as it may act in one half only, and of flights without a gyro, whose one mean pattern has no halves.

    before, after: without the named effects in the model and with them, equal where none is named; floor: 1.
    """

    before: float
    after: float
    floor: float


@dataclass(frozen=True)
class Control:
    """How far an effect that is deliberately a wrong one closes the gap."""

    name: str
    closure: Closure

    def plain(self) -> dict[str, Any]:
        """JSON-ready."""
        return {"name": self.name, **self.closure.plain()}


@dataclass(frozen=True)
class HowFar:
    """How far the gap closes with one model; fields as those of `Closure`, None where no effect is named.

    own_start: whether the vehicle is not the calibrated one, so that model, floor and the gap before are others.
    """

    model: str
    before: float
    after: float
    shrink: Quantity | None
    floor: float | None = None
    own_start: bool = False


@dataclass(frozen=True)
class NamedEffect:
    """An effect that the diagnosis names, with its fitted parameters.

    seconds: intervals (flight, from_s, to_s) in which it acts; empty where it always does.
    """

    name: str
    parameters: Mapping[str, Quantity]
    seconds: tuple[tuple[str, float, float], ...] = ()


class RotorSet(NamedTuple):
    """Rotors, numbered from 1, and the probability that these and no others are weak."""

    rotors: tuple[int, ...]
    probability: float


@dataclass(frozen=True)
class RankedCandidate:
    """A candidate of the ranking.

    shrink: fraction of the gap that it closes on held-out data; why: the reason why it is not the answer; nats: log
    likelihood that held-out data gain by it alone; measured: False where its shrink was not measured and stands as 0;
    rotor_sets: of weak_motor where hovers are judged without a gyro and it is the answer, likeliest first; their
    probabilities add up to its own.
    """

    name: str
    probability: float
    shrink: Quantity
    why: str = ""
    nats: float | None = None
    measured: bool = True
    rotor_sets: tuple[RotorSet, ...] = ()

    def plain(self) -> dict[str, Any]:
        """JSON-ready, without a reason, nats or sets that there are not; a shrink that was not measured says so."""
        more = ({"why": self.why} if self.why else {}) | ({} if self.nats is None else {"nats": self.nats})
        sets = {"rotor_sets": [s._asdict() for s in self.rotor_sets]} if self.rotor_sets else {}
        shrink = self.shrink.plain() | ({} if self.measured else {"measured": False})
        return {"name": self.name, "probability": self.probability, "shrink": shrink, **more, **sets}


@dataclass(frozen=True)
class Rejected:
    """An effect that is not named though it gains much, and why, in words."""

    name: str
    why: str

    def plain(self) -> dict[str, str]:
        """JSON-ready."""
        return {"name": self.name, "fails": self.why}


HELD_OUT, FITTED = "held out", "fitted"  #: data that effects were not fitted to, and those that they were fitted to
REST_OF_FLIGHT = "rest of the flight"  #: as the floor of an open cell


@dataclass(frozen=True)
class OpenCell:
    """A channel, band and phase of flight that no effect named explains, and when.

    from_s, to_s: interval of a flight in which most of its gap is, over_floor: rms over the floor there at most;
    follows: signals that its power ranks like; nearest: effects that gain most; floor: what its floor is, that of the
    map or, where a flight is less steady than nominal ones, REST_OF_FLIGHT, whose median rms it is.
    """

    channel: str
    band_hz: tuple[float, float]
    phase: str
    flight: str
    from_s: float
    to_s: float
    over_floor: float
    follows: tuple[str, ...] = ()
    nearest: tuple[Rejected, ...] = ()
    floor: str = "nominal flights"

    def plain(self) -> dict[str, Any]:
        """JSON-ready."""
        return {**asdict(self), "nearest": [r.plain() for r in self.nearest]}


@dataclass(frozen=True)
class NextStep:
    """What to do next: a sentence, the command that does it, the heading of a page; "" where there is none."""

    text: str
    command: str = ""
    page: str = ""

    def plain(self) -> dict[str, str]:
        """JSON-ready, without what is ""."""
        return {k: v for k, v in asdict(self).items() if v}


@dataclass(frozen=True, repr=False)
class Diagnosis:
    """The answer to where, which and how far.

    verdict: "effect", "none" or "unknown"; shrink: fraction of the gap that the named effects close, None where none is
    named; judged_on: the data on which the gap with them is measured, HELD_OUT or FITTED; control: how far a
    deliberately wrong effect closes it, None where none was wrong; arms: how far the named effects do with the vehicle
    as declared and as calibrated (`answer.controls.arms_of`). Terminal, report and JSON show this and compute nothing
    of their own.
    """

    verdict: str
    effects: tuple[NamedEffect, ...]
    ranking: tuple[RankedCandidate, ...]
    indistinguishable: tuple[tuple[str, ...], ...]
    where: tuple[Cell, ...]
    gap: OverallGap
    shrink: Quantity | None
    control: Control | None
    arms: Mapping[str, Closure] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    cannot: tuple[str, ...] = ()
    flights: tuple[str, ...] = ()
    unexplained: tuple[OpenCell, ...] = ()  #: what no named effect explains, largest first
    map: GapMap | None = None  #: every cell, of which `where` has the largest
    headline: Cell | None = None  #: the cell that the answer speaks of
    next: tuple[NextStep, ...] = ()  #: what to do next
    vehicle: str = ""
    judged_on: str = HELD_OUT
    baseline: tuple[str, ...] = ()
    calibration: Mapping[str, Quantity] = field(default_factory=dict)  #: of the vehicle, on the baseline flights
    #: `gap.answer.curves.Curves`, where they were asked for
    curves: "Curves | None" = field(default=None, repr=False, compare=False)
    #: study and calibration, to diagnose further flights alike
    calibrated: "tuple[Study, Calibration | None] | None" = field(default=None, repr=False, compare=False)
    #: of that calibration the vehicle, name and hash of the baseline flights, those left out included, and the names of
    #: the effects left out
    calibrated_with: "tuple[Vehicle, tuple[str, ...], tuple[str, ...]] | None" = field(default=None, repr=False,
                                                                                      compare=False)

    def __post_init__(self) -> None:
        """Verdict, effects and ranking say one thing: ValueError where they do not."""
        named = [e.name for e in self.effects]
        answer = (named or ["effect"])[0] if self.verdict == "effect" else self.verdict
        if self.ranking and (answer != self.ranking[0].name or bool(named) != (self.verdict == "effect")):
            raise ValueError(f"the ranking begins with {self.ranking[0].name}, the verdict is {self.verdict} {named}")

    @property
    def how_far(self) -> tuple[HowFar, ...]:
        """How far the gap closes: with the named effects, with a wrong one, and without the vehicle's calibration.

        An arm whose shrink is that of the answer is the answer, and is left out.
        """
        named = ", ".join(e.name for e in self.effects)
        rows = []
        if self.gap:
            rows.append(HowFar(named, self.gap["before"], self.gap["after"], self.shrink, self.gap.get("floor")))
        if self.control is not None:
            wrong = self.control.closure
            rows.append(HowFar(f"wrong effect: {self.control.name}", wrong.before, wrong.after, wrong.shrink))
        rows += [HowFar(f"{named}, vehicle as {name}", arm.before, arm.after, arm.shrink, own_start=True)
                 for name, arm in self.arms.items() if arm.shrink != self.shrink]
        return tuple(rows)

    @property
    def advice(self) -> str:
        """What to do next, as text."""
        return " ".join(step.text for step in self.next)

    def __repr__(self) -> str:
        """One line: verdict, effects, the answer's probability, gap before and after; `plain` has everything."""
        parts = [self.verdict, ", ".join(e.name for e in self.effects)]
        if self.ranking:
            parts.append(f"probability {self.ranking[0].probability:.0%}")
        before, after = self.gap.get("before"), self.gap.get("after")
        if before is not None and after is not None:
            parts.append(f"gap {before:.3g} before, {after:.3g} after (floor 1)")
        return f"Diagnosis({'; '.join(s for s in parts if s)})"

    def plain(self) -> dict[str, Any]:
        """JSON-ready, the keys of host/docs/gap-json.md; floats rounded to six digits."""
        content = {
            "verdict": self.verdict,
            "effects": [{"name": e.name, "parameters": {k: q.plain() for k, q in e.parameters.items()},
                         **({"seconds": [{"flight": f, "from_s": a, "to_s": b} for f, a, b in e.seconds]}
                            if e.seconds else {})} for e in self.effects],
            "ranking": [r.plain() for r in self.ranking],
            "indistinguishable": [list(g) for g in self.indistinguishable],
            "where": [plain_cell(c) for c in self.where],
            "gap": dict(self.gap), "shrink": self.shrink.plain() if self.shrink else None, "judged_on": self.judged_on,
            "control": self.control.plain() if self.control else {}, "advice": self.advice,
            "arms": {name: arm.plain() for name, arm in self.arms.items()},
            "notes": list(self.notes), "cannot": list(self.cannot), "flights": list(self.flights),
            "unexplained": [u.plain() for u in self.unexplained], "next": [s.plain() for s in self.next],
            "headline": plain_cell(self.headline) if self.headline else None, "vehicle": self.vehicle,
            "baseline": list(self.baseline), "calibration": {k: q.plain() for k, q in self.calibration.items()},
            "floor_from": self.map.floor_from if self.map else None,
            "map": [plain_cell(c) for c in self.map.cells] if self.map else [],
        }
        return rounded(content)


def rounded(value: Any) -> Any:
    """Plain data with floats to six digits, None where not finite."""
    if isinstance(value, Mapping):
        return {k: rounded(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [rounded(v) for v in value]
    if isinstance(value, (float, np.floating)):
        return float(f"{float(value):.6g}") if np.isfinite(value) else None
    return int(value) if isinstance(value, np.integer) else value
