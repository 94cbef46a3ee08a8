"""What the answer is held against: a deliberately wrong effect, and the vehicle as its file declares it."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from airtouch.gap.answer.ranking import alike_of
from airtouch.gap.answer.shrink import Cells, Shrink, cells_of, shrink_of
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.fit import fit
from airtouch.gap.flights.flight import Flight
from airtouch.gap.naming.judging import halves
from airtouch.gap.naming.selection import Judged, Selection
from airtouch.gap.nominal.build_study import declared_study
from airtouch.gap.nominal.calibrate import Calibration
from airtouch.gap.result import Diagnosis
from airtouch.gap.signatures import candidates
from airtouch.gap.signatures.signature import CLOCK, MEAN, WRONG
from airtouch.vehicle import Vehicle


def control(data: Data, selection: Selection, cells: Cells) -> dict[str, Any]:
    """The gap with a deliberately wrong effect in the model, JSON-ready; empty where none of WRONG is wrong.

    cells: in which the gap is measured.
    """
    right = {name for group in alike_of(selection) for name in group} | {s.name for s in selection.named}
    variants = candidates.all_candidates()
    name = next((n for n in WRONG if n in variants and n not in right), None)
    if name is None:
        return {}
    fits = tuple(fit(data, part, variants[name][0]) for part in selection.parts)
    return {"name": name, **_plain(shrink_of(data, selection.parts, Judged(name, fits[0].terms, 0.0, fits), cells))}


def arms(vehicle: Vehicle, nominal: Sequence[Flight], calibration: Calibration | None, judged: Sequence[Flight],
         selection: Selection, answer: Diagnosis) -> dict[str, Any]:
    """The shrink with the vehicle as calibrated and as its file declares it, JSON-ready; the latter without baseline.

    judged: the flights that the answer comes from.
    """
    overall = {"before": answer.gap["before"], "after": answer.gap["after"],
               "shrink": answer.shrink.plain() if answer.shrink else {}}
    if not nominal or selection.chosen is None:
        return {"declared": overall}
    study = (calibration.declared if calibration is not None else None) or declared_study(vehicle, nominal)
    data = Data(study, judged)
    parts = halves(data)
    terms = tuple(t for t in selection.chosen.terms if t.kind != CLOCK)
    fits = tuple(fit(data, part, terms, _start(selection.chosen)) for part in parts)
    hypothesis = Judged(selection.chosen.name, terms, 0.0, fits)
    return {"declared": _plain(shrink_of(data, parts, hypothesis, cells_of(data, parts, hypothesis))),
            "calibrated": overall}


def _start(chosen: Judged) -> np.ndarray | None:
    """Scaled parameters (k,) of mean effects as they were fitted to the first half; None where none was."""
    if not chosen.fits:
        return None
    return np.concatenate([np.zeros(0),
                           *(t.scaled(t.values) for t in chosen.fits[0].terms if t.kind == MEAN)])


def _plain(shrink: Shrink) -> dict[str, Any]:
    return {"before": shrink.before, "after": shrink.after, "shrink": shrink.share.plain()}
