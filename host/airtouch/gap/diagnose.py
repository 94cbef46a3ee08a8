"""Where, which, how far: the whole diagnosis of some flights."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.gap import callable_module, measure
from airtouch.gap.answer import advice as advices
from airtouch.gap.answer import pictures as picture
from airtouch.gap.answer.shrink import Cells, Shrink, cells_of, shrink_of
from airtouch.gap.answer.unexplained import unexplained, why_not
from airtouch.gap.balance import balance_result
from airtouch.gap.evidence.data import Data, Study
from airtouch.gap.evidence.fit import Fit, fit, judge, strength_variance
from airtouch.gap.evidence.problem import LOOP, Part, whole_of
from airtouch.gap.flights.flight import Flight
from airtouch.gap.loop.twin import Twin
from airtouch.gap.naming.judging import FIRST_GAIN, halves
from airtouch.gap.naming.select import LOOP_SHARE, select
from airtouch.gap.naming.selection import Judged, Selection, probabilities
from airtouch.gap.nominal import calibrate
from airtouch.gap.result import Diagnosis, Found, Quantity, Ranked
from airtouch.gap.signals.spectra import AIR
from airtouch.gap.signatures import candidates
from airtouch.gap.signatures.candidates import CLOCK, Term
from airtouch.gap.where import summary
from airtouch.gap.where.gap_map import gap_map, where
from airtouch.logs.flight_log import FlightLog
from airtouch.vehicle import Vehicle

MOST_SECONDS = 210.0  #: of flight that candidates are fitted and judged on; more adds time, not certainty
AT_FLOOR = 1.0  #: gap that is at its floor
CALMED = 0.5  #: of how far a flight is below the floor, that effects named may leave
CLOSE = 3.0  #: two candidates whose held-out log likelihood differs by less cannot be told apart
SHAPE_PRICE = 1.0  #: log likelihood that another shape of an effect must gain on all the data
ASSUMED = 0.1  #: of a parameter, by which the model of the loop or of a random effect's spectrum may be wrong
NO_BASELINE = ("no baseline flights: the vehicle is taken as declared, and torque is judged in the mean alone, as "
               "nobody knows how much of the commanded torque is aliases of a faster loop")
WRONG = ("rotor_drag", "com_offset", "motor_lag", "thrust_coefficient", "imu_bias")


def diagnose(flights: Sequence[FlightLog], vehicle: Vehicle, baseline: Sequence[FlightLog] = (), *,
             progress: Callable[[str], None] | None = None, without: Iterable[str] = (),
             pictures: bool = False, before: Diagnosis | None = None) -> Diagnosis:
    """Name the unmodelled effect that the flights have in common and how much of the gap it is.

    flights: one or more; what they share is looked for. baseline: flights declared free of
    unmodelled effects, on which the vehicle is calibrated and the floor is measured; without
    them the floor is the sensors' declared noise and the twin view is left out. without:
    names of effects to leave out. pictures: whether to keep the curves that a report shows. before: a
    diagnosis with the same vehicle, baseline and effects left out, whose calibration is used again. Raises
    AirTouchError when no flight can be used.
    """
    say, without = progress or (lambda _: None), tuple(without)
    left_out: list[str] = []
    nominal = list(measure.usable(baseline, vehicle, left_out))
    seen = list(measure.usable(flights, vehicle, left_out))
    if not seen:
        raise AirTouchError(left_out[-1] if left_out else "no flight to diagnose")
    if balance_result.applies(seen, nominal, vehicle):
        return balance_result.diagnosis(seen, nominal, vehicle, left_out, without, pictures)
    say("calibration")
    if before is not None and before.held is not None:
        study, fitted = before.held
    else:
        study, fitted = calibrate.calibrated(vehicle, nominal, without=without) if nominal \
            else (calibrate.declared(vehicle, ()), None)
    some = _some(seen)
    data = _data(study, some)
    selection, gap_cells = _selected(data, without, say)
    say("how far")
    ranking, overall, verdict, effects = _ranking(data, selection, gap_cells)
    named = [candidates.term_of(e) for e in effects]
    made = gap_map(study, seen, nominal, named)
    first = summary.headline(made.cells, bool(named))
    cells = tuple(dict.fromkeys([c for c in (first,) if c is not None] + where(made)))
    alike = _alike(selection)
    notes = [n for f in seen for n in f.notes] + left_out
    notes += list(fitted.notes) if fitted else [NO_BASELINE]
    notes += measure.differences(study, nominal)
    notes += measure.flown_unlike(study, seen)
    if len(some) < len(seen):
        notes.append(f"candidates were judged on {len(some)} of {len(seen)} flights, evenly chosen")
    control = _control(data, selection, gap_cells) if verdict == "effect" else {}
    steps = advices.steps(verdict, effects, alike, first, seen, bool(nominal), vehicle.name)
    return Diagnosis(
        verdict, tuple(effects), tuple(ranking), alike, cells,
        {"before": overall.before, "after": overall.after if verdict == "effect" else overall.before,
         "floor": 1.0},
        overall.share if verdict == "effect" else None, control, advices.advice(steps),
        _arms(vehicle, nominal, some, selection, overall) if verdict == "effect" else {}, tuple(dict.fromkeys(notes)),
        measure.cannot_of([f.cannot for f in seen]), tuple(f.name for f in seen),
        tuple(unexplained(study, some, selection, cells)) if verdict == "unknown" else (), made, first, steps,
        vehicle.name, tuple(f.name for f in nominal), fitted.parameters if fitted else {},
        picture.of(study, seen, nominal, named, first, cells) if pictures else None, (study, fitted))


def brief(study: Study, flights: Sequence[Flight], without: Iterable[str] = (), data: Data | None = None) -> Diagnosis:
    """`diagnose` with a study that is there already, without map, arms and advice: for many cases alike.

    data: of an earlier call with the same flights, whose spectra are used again. Raises as `diagnose`.
    """
    data = _data(study, flights) if data is None else data
    selection, gap_cells = _selected(data, tuple(without))
    ranking, overall, verdict, effects = _ranking(data, selection, gap_cells)
    named = verdict == "effect"
    return Diagnosis(
        verdict, tuple(effects), tuple(ranking), _alike(selection), (),
        {"before": overall.before, "after": overall.after if named else overall.before, "floor": 1.0},
        overall.share if named else None, _control(data, selection, gap_cells) if named else {}, "",
        flights=tuple(f.name for f in flights))


def _data(study: Study, flights: Sequence[Flight]) -> Data:
    """The flights with their spectra; torque in the mean alone where nobody knows which share of it is aliases."""
    data = Data(study, flights, slow=study.response is None)
    if any(not sum(chosen.sum() for _, regime, chosen in p.pieces if regime == AIR) for p in halves(data)):
        raise AirTouchError(f"{flights[0].name}: too short to be judged on other data than it is fitted on; at least "
                            "5 s in the air without a hole are needed")
    return data


def _selected(data: Data, without: Sequence[str], say: Callable[[str], None] = lambda _: None,
              ) -> tuple[Selection, Cells]:
    """What is chosen among the candidates, and the cells in which the gap is measured.

    In recorded flights an effect of the loop must take away as much of the gap as the loop model may be wrong by: the
    gains of two days differ a little, and that is not what a gap comes from.
    """
    selection = select(data, candidates.every(without), say, without)
    cells = cells_of(data, selection.parts, selection.chosen)
    if data.study.recorded and _of_the_loop(data, selection) \
            and shrink_of(data, selection.parts, selection.chosen, cells).share.value < LOOP_SHARE:
        selection = replace(selection, steps=(), free_after=selection.free_before, assumed=False)
        cells = cells_of(data, selection.parts, None)
    return selection, cells


def _of_the_loop(data: Data, selection: Selection) -> bool:
    """Whether one effect is named, and it is one of the control loop."""
    law, chosen = data.study.controller, selection.chosen
    if law is None or chosen is None or len(selection.named) != 1:
        return False
    terms = [t for t in chosen.terms if t.kind == candidates.MEAN and not t.gate]
    return bool(terms) and (law.changes_loop([t.active() for t in terms]) or any(t.name in LOOP for t in terms))


def _some(flights: Sequence[Flight]) -> list[Flight]:
    """Evenly chosen flights of MOST_SECONDS together; all where there are no more."""
    total = sum(len(f) for f in flights) * 0.01
    keep = max(int(len(flights) * min(MOST_SECONDS / total, 1.0)), min(len(flights), 4))
    return [flights[i] for i in np.unique(np.linspace(0, len(flights) - 1, keep).astype(int))]


def _verdict(selection: Selection, gap: Shrink, simulated: bool) -> str:
    """What does not stand over the floor is nothing, whatever small differences add up to.

    What the log has done to itself shows in its times alone, and is no part of the gap; what comes and goes is seldom
    in both halves of the data, in whose common part the gap is measured. simulated: the flights are a simulator's;
    there a flight calmer than nominal ones, which the effects named bring to the floor, has them, and no nominal flight
    has odd times; a recorded one had calm air or a poor link.
    """
    calmed = simulated and abs(gap.after - AT_FLOOR) < CALMED * abs(gap.before - AT_FLOOR)
    odd_times = simulated and selection.of_times > selection.allowed
    apart = selection.chosen is not None and all(t.kind == CLOCK or t.gate for t in selection.chosen.terms)
    if gap.before <= AT_FLOOR and not (apart or calmed or odd_times):
        return "none"
    if not selection.explained:
        return "unknown"
    return "none" if selection.chosen is None else "effect"


def chosen_effects(data: Data, selection: Selection) -> list[Found]:
    """The effects chosen, fitted anew on all the data, with 90 % intervals."""
    judged = selection.whole
    if selection.chosen is None or judged is None:
        return []
    others = [t for t in judged.terms if t.kind != CLOCK]
    whole = whole_of(data)
    fitted = (best_shape(data, whole, others, _middle(judged)) if others
              else Fit((), np.zeros(0), np.zeros((0, 0)), np.zeros(0), 0.0))
    chosen = {t.name for t in selection.chosen.terms}
    out, place = [], 0
    for t in fitted.terms:
        part = slice(place, place + len(t.free)) if t.kind == candidates.MEAN else None
        if part is not None:
            place += len(t.free)
        if t.name not in chosen:
            continue
        if t.companion:
            out = [with_random_part(e, t) for e in out]
            continue
        x = fitted.scaled[part] if part is not None else t.scaled(t.values)
        known = fitted.covariance[part, part] if part is not None else strength_variance(data, whole, fitted.terms, t)
        spread = _spread(data.study.controller, judged, t, known)
        out.append(Found(t.name, t.quantities(x, spread), t.gate))
    for t in (t for t in selection.chosen.terms if t.kind == CLOCK):
        x = t.scaled(t.values)
        n = sum(len(f) for f in data.flights)
        out.append(Found(t.name, t.quantities(x, np.diag(x ** 2 / max(2.0 * n / 10.0, 1.0)))))
    order = {s.name: i for i, s in reversed(list(enumerate(selection.named)))}
    return sorted(out, key=lambda e: order.get(e.name, len(order)))  # the first is that of the ranking


def best_shape(data: Data, whole: Part, terms: Sequence[Term], start: np.ndarray | None) -> Fit:
    """Effects fitted to all the data, in the shape that gains most; another than that found must earn its choice."""
    best = fit(data, whole, terms, start)
    for i, term in enumerate(terms):
        level = judge(data, whole, best.terms) + SHAPE_PRICE
        for shaped in term.shaped():
            tried = fit(data, whole, [*terms[:i], shaped, *terms[i + 1:]], start)
            gained = judge(data, whole, tried.terms)
            if gained > level:
                best, level = tried, gained
    return best


def with_random_part(effect: Found, part: Term) -> Found:
    """An effect with its random part as fitted, so that it can be switched on as it stands.

    The part was fitted at its own strength (1, of the published curve), while the effect has one strength for
    mean and random part: the part's parameters are divided by it. A mean too weak to carry them within their
    bounds is raised to the least that does.
    """
    if effect.name != part.name:
        return effect
    own, given = part.values["strength"], effect.parameters["strength"]
    limits = {p.name: p.high for p in part.effect.parameters}
    strength = max(given.value, *(own * part.values[k] / limits[k] for k in part.free), 1e-6)
    raised = replace(given, value=strength, high=strength if given.high is None else max(given.high, strength))
    scaled = {k: replace(effect.parameters[k], value=own * part.values[k] / strength) for k in part.free}
    return Found(effect.name, {**effect.parameters, "strength": raised, **scaled}, effect.seconds)


def _start(terms: Sequence[Term], chosen: Judged) -> np.ndarray | None:
    """Scaled parameters of mean effects as they were fitted."""
    if not chosen.fits:
        return None
    return np.concatenate([np.zeros(0),
                           *(t.scaled(t.values) for t in chosen.fits[0].terms if t.kind == candidates.MEAN)])


def _middle(chosen: Judged) -> np.ndarray | None:
    scaled = [f.scaled for f in chosen.fits]
    return np.mean(scaled, axis=0) if scaled and len(scaled[0]) else None


def _spread(law: Twin | None, chosen: Judged, term: Term, covariance: np.ndarray) -> np.ndarray:
    """Covariance of a term's parameters: the likelihood's, or the two halves' disagreement and the model's doubt."""
    pairs = [t.scaled(t.values) for f in chosen.fits for t in f.terms
             if t.name == term.name and t.values.get("rotor") == term.values.get("rotor")]
    apart = np.zeros((len(term.free), len(term.free)))
    if len(pairs) == 2:
        apart = np.diag((0.5 * (pairs[0] - pairs[1])) ** 2)
    assumed = term.kind == candidates.SPECTRUM or (law is not None and law.changes_loop((term.active(),)))
    doubt = np.diag((ASSUMED * term.scaled(term.values)) ** 2) if assumed else 0.0
    return covariance + apart + doubt


def _ranking(data: Data, selection: Selection, cells: Cells) -> tuple[list[Ranked], Shrink, str, list[Found]]:
    """Every candidate with probability and shrink, best first; the shrink of what was chosen; verdict and effects."""
    parts = selection.parts
    overall = shrink_of(data, parts, selection.chosen, cells)
    verdict = _verdict(selection, overall, data.study.simulated)
    effects = chosen_effects(data, selection) if verdict == "effect" else []
    answer = effects[0].name if effects else verdict
    chance = agreeing(probabilities(selection, verdict == "none"), answer)
    out = []
    for name, p in chance.items():
        one = selection.singles.get(name)
        share = Quantity(0.0)
        if name == answer and effects and len(selection.named) == 1:
            share = overall.share
        elif one is not None and one.full and one.gain > FIRST_GAIN:
            share = shrink_of(data, parts, one, cells).share
        out.append(Ranked(name, float(p), share, why_not(selection, name, verdict)))
    order = {n: j.gain for n, j in selection.singles.items()}
    out.sort(key=lambda r: (r.name != answer, -r.probability, -order.get(r.name, 0.0)))
    return out, overall, verdict, effects


def agreeing(chance: Mapping[str, float], answer: str) -> dict[str, float]:
    """The probabilities with the answer's at least as large as any other: it changes places with a larger one.

    The verdict weighs what the ranking of single candidates does not, as effects that come and go.
    """
    out = {answer: 0.0, **chance}
    best = max(out, key=out.__getitem__)
    out[answer], out[best] = out[best], out[answer]
    return out


def _alike(selection: Selection) -> tuple[tuple[str, ...], ...]:
    """Sets that these logs cannot tell apart: named twins, and candidates as good as the best."""
    if not selection.named:
        return ()
    groups = []
    best = selection.named[0]
    same = [n for n, j in selection.singles.items() if j.full and best.gain - j.gain < CLOSE]
    if len(same) > 1:
        groups.append(tuple(sorted(same)))
    for step in selection.named:
        twins = candidates.twins_of(step.name)
        if twins and not any(step.name in g for g in groups):
            groups.append(tuple(sorted(twins[0])))
    return tuple(groups)


def _control(data: Data, selection: Selection, cells: Cells) -> dict[str, object]:
    """The gap with a deliberately wrong effect in the model."""
    taken = {n for g in _alike(selection) for n in g} | {s.name for s in selection.named}
    every = candidates.every()
    for name in WRONG:
        if name in every and name not in taken:
            fits = tuple(fit(data, p, every[name][0]) for p in selection.parts)
            done = shrink_of(data, selection.parts, Judged(name, fits[0].terms, 0.0, fits), cells)
            return {"name": name, "before": done.before, "after": done.after, "shrink": done.share.plain()}
    return {}


def _arms(vehicle: Vehicle, nominal: Sequence[Flight], some: Sequence[Flight], selection: Selection,
          overall: Shrink) -> dict[str, object]:
    """The shrink with the vehicle as calibrated (or declared, without baseline) and as its file declares it."""
    if not nominal or selection.chosen is None:
        return {"declared": _plain(overall)}
    data = Data(calibrate.declared(vehicle, nominal), some)
    parts = halves(data)
    terms = tuple(t for t in selection.chosen.terms if t.kind != CLOCK)
    fits = tuple(fit(data, p, terms, _start(terms, selection.chosen)) for p in parts)
    declared = Judged(selection.chosen.name, terms, 0.0, fits)
    one = shrink_of(data, parts, declared, cells_of(data, parts, declared))
    return {"declared": _plain(one), "calibrated": _plain(overall)}


def _plain(shrink: Shrink) -> dict[str, object]:
    return {"before": shrink.before, "after": shrink.after, "shrink": shrink.share.plain()}


callable_module(__name__)
