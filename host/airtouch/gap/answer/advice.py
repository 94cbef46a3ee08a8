"""What to fly or log next: the manoeuvre or channel that would settle what these logs leave open, with its command."""

import shlex
from collections.abc import Sequence

from airtouch.gap.answer.words import joined
from airtouch.gap.flights.flight import Flight
from airtouch.gap.result import Diagnosis, NamedEffect, NextStep
from airtouch.gap.signatures.alike import confusions_among
from airtouch.gap.where.cell import Cell
from airtouch.gap.where.cell_words import PHASE_WORDS
from airtouch.simulation.effects import EFFECTS, source_of
from airtouch.vehicle import Vehicle, argument_of

#: what tells an effect from none, which flights without a gyro alone may leave open
MORE_FLIGHTS = ("hover in more nominal flights for the baseline: the more there are, the smaller the difference that "
                "shows")
ADD_AN_EFFECT = "An effect of your own"  #: heading of the page that says how
URI = "radio://0/80/2M/E7E7E7E7E7"  #: radio address of a Crazyflie as it ships
#: by phase, the mission with most of it; take-off and landing are in every one
MISSIONS = {"hover": "hover", "cruise": "there-and-back", "over platform": "sweep"}
#: of an effect that is named without a baseline; a detector trained with the noise that the authors' flights are given
#: so finds no edge (host/docs/gap-findings.md, "Trained on what today's diagnosis finds")
TRAINING_WARNING = (" Without a baseline it may stand for all in which the flights differ from the declared vehicle: "
                    "do not train a detector on it.")


def next_steps(answer: Diagnosis, flights: Sequence[Flight], vehicle: Vehicle, extrapolated: bool = False,
               own_effects: bool = True) -> tuple[NextStep, ...]:
    """The steps to take next, most useful first.

    answer: complete but for these steps; flights: those that were diagnosed; vehicle: as declared; extrapolated:
    whether some were flown unlike the baseline, so that their floor is extrapolated; own_effects: whether effects of a
    user's own are candidates.
    """
    argument = argument_of(vehicle)
    steps = []
    if not answer.baseline:
        steps.append(NextStep(
            "Give flights that are known to be nominal with --baseline: they lower the floor and show delays and gains "
            "of the controller.", f"airtouch gap diagnose REAL --vehicle {argument} --baseline NOMINAL..."))
    steps += [step for group in answer.indistinguishable for step in _steps_to_tell_apart(group)]
    if answer.verdict == "unknown":
        steps += _steps_for_open_gap(answer.headline, argument, own_effects)
    if answer.verdict == "effect":
        names = " and ".join(dict.fromkeys(e.name for e in answer.effects))
        always = " There it acts for the whole flight, not in its seconds alone."
        steps.append(NextStep(
            f"Switch on {names} with these parameters in the simulator, and fly it again."
            + always * any(e.seconds for e in answer.effects) + TRAINING_WARNING * (not answer.baseline),
            simulate_command(answer.effects, argument)))
    if answer.verdict == "none" and extrapolated:
        steps.append(NextStep(
            "Fly the baseline like the test: the floor is extrapolated to the test, and may hide an effect."))
    if any(f.rates is None for f in flights):
        steps.append(NextStep("Log the gyro: it shows torque at every frequency."))
    return tuple(steps) or (NextStep("Nothing to add; longer flights would lower the floor."),)


def simulate_command(effects: Sequence[NamedEffect], vehicle: str) -> str:
    """The command that flies the named effects in the simulator; a passing effect acts for the whole flight there.

    vehicle: what `--vehicle` takes.
    """
    words = ["airtouch", "simulate", "diagnosis", "-n", "5", "--out", "with-effect", "--vehicle", vehicle]
    for e in effects:
        arguments = [f"{k}={_argument(e.name, k, q.value)}{q.unit.replace(' ', '').removeprefix('1')}"
                     for k, q in e.parameters.items()]
        words += [*(("--effect-file", file) if (file := source_of(e.name)) else ()),
                  "--effect", e.name + (":" + ",".join(arguments) if arguments else "")]
    return shlex.join(words)


def _argument(effect: str, parameter: str, value: float) -> str:
    """A value as the command takes it: four digits, and within the parameter's bounds, which rounding may leave."""
    bounds = {p.name: p for p in EFFECTS[effect].parameters}.get(parameter) if effect in EFFECTS else None
    text = f"{value:.4g}"
    if bounds is not None and not bounds.low <= float(text) <= bounds.high:
        text = f"{min(max(value, bounds.low), bounds.high):.17g}"
    return text


def collect_command(mission: str) -> str:
    """The command that flies a mission three times."""
    return f"airtouch collect --uri {URI} --mission {mission} -n 3 --out more"


def _steps_to_tell_apart(group: Sequence[str]) -> list[NextStep]:
    """The steps that tell the effects of a group from one another, and from "none" where that is in it."""
    effects = [name for name in group if name != "none"]
    steps = [NextStep(f"To tell {' from '.join(sorted(c.effects))}: {c.remedy}.",
                      collect_command(c.mission) if c.mission else "")
             for c in (confusions_among(effects) if len(effects) > 1 else [])]
    if len(effects) < len(group):
        steps.append(NextStep(f"To tell {joined(effects)} from no effect: {MORE_FLIGHTS}.", collect_command("hover")))
    return steps


def _steps_for_open_gap(headline: Cell | None, argument: str, own_effects: bool) -> list[NextStep]:
    """The steps for a gap that no known effect explains: more of the phase with most of it, and an effect of one's own.

    argument: what `--vehicle` takes; own_effects: whether such effects are candidates.
    """
    steps = []
    if headline is not None and headline.phase in MISSIONS:
        steps.append(NextStep(
            f"Repeat the flight with more time {PHASE_WORDS[headline.phase]}, where most of the gap is.",
            collect_command(MISSIONS[headline.phase])))
    elif headline is not None:
        steps.append(NextStep(
            "Repeat the same flight three times: what stays is the vehicle's, what changes is the air's."))
    if own_effects:
        steps.append(NextStep(
            "Write the effect that you suspect in a file of your own, and diagnose again with it among the candidates.",
            f"airtouch gap diagnose REAL --vehicle {argument} --baseline NOMINAL... --effect-file mine.py",
            ADD_AN_EFFECT))
    return steps
