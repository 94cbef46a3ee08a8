"""Figures of CrazyPAD's diagnoses: family, rotors and severity against the labels, with 90 % intervals.

A case is a flight's diagnosis with its labels: drone, condition, verdict, effects (`Diagnosis.plain`).
"""

from collections.abc import Callable

import numpy as np
from scipy.stats import spearmanr

from airtouch.detector.evaluation.bootstrap import resampled

from .labels import FAMILIES, LEAST_MM, cut_mm, family, large, millimetres, rotors

#: effect that a diagnosis names -> family
FAMILY_OF = {"weak_motor": "rotor damage", "mass": "added weight", "com_offset": "added weight",
             "slung_load": "slung load"}
#: a diagnosis that names rotor damage, of no rotor
ROTOR_DAMAGE: dict = {"verdict": "effect", "effects": [
    {"name": "weak_motor", "parameters": {"rotor": {"value": 0}, "thrust_loss": {"value": 0.0}}}]}
RESAMPLES = 2000  #: bootstrap samples; no source: round number, which gives an interval to 0.01 or so


def answer(case: dict) -> tuple[str, list[int], float]:
    """The family, the rotors and the summed loss of thrust that a diagnosis names."""
    names = [e["name"] for e in case["effects"]]
    if case["verdict"] != "effect":
        return ("normal" if case["verdict"] == "none" else "unknown"), [], 0.0
    weak = [e["parameters"] for e in case["effects"] if e["name"] == "weak_motor"]
    return FAMILY_OF.get(names[0], "other"), sorted(round(p["rotor"]["value"]) for p in weak), \
        sum(p["thrust_loss"]["value"] for p in weak)


def balanced_accuracy(table: list[dict]) -> float:
    """Mean over families of the fraction named right; families without flights are left out."""
    fractions = []
    for f in FAMILIES:
        hits = [answer(c)[0] == f for c in table if family(c["condition"]) == f]
        fractions += [np.mean(hits)] if hits else []
    return float(np.mean(fractions)) if fractions else float("nan")


def interval(table: list[dict], figure: Callable[[list[dict]], float]) -> tuple[float, float]:
    """90 % interval of a figure, resampling conditions (of a drone) within families."""
    groups: dict[str, dict[str, list[dict]]] = {}
    for c in table:
        groups.setdefault(family(c["condition"]), {}).setdefault(c["drone"] + c["condition"], []).append(c)
    families = [list(conditions.values()) for conditions in groups.values()]

    def figure_of(*picks: np.ndarray) -> float:
        """The figure of a sample: the numbers of the conditions that it has of each family."""
        return figure([case for conditions, pick in zip(families, picks, strict=True)
                       for k in pick for case in conditions[k]])

    low, high = resampled(figure_of, *map(len, families), replicates=RESAMPLES, level=0.9)
    return low, high


def with_interval(table: list[dict], figure: Callable[[list[dict]], float], digits: int = 2) -> str:
    """A figure and its 90 % interval, as text."""
    low, high = interval(table, figure)
    return f"{figure(table):.{digits}f} ({low:.{digits}f} to {high:.{digits}f})"


def forgiven(table: list[dict]) -> float:
    """`balanced_accuracy`, where a cut of less than LEAST_MM may be called normal."""
    def is_excused(c: dict) -> bool:
        """Whether a small cut was called normal."""
        return bool(millimetres(c["condition"])) and not large(c["condition"]) and answer(c)[0] == "normal"

    return balanced_accuracy([c for c in table if not is_excused(c)]
                             + [{**c, **ROTOR_DAMAGE} for c in table if is_excused(c)])


def exact_rotors(table: list[dict]) -> float:
    """Share of rotor-damage flights for which exactly the damaged rotors are named."""
    hit = [answer(c)[1] == rotors(c["condition"]) for c in table if rotors(c["condition"])]
    return float(np.mean(hit)) if hit else float("nan")


def only_damaged_rotors(table: list[dict]) -> float:
    """Share of rotor-damage flights for which a damaged rotor and no sound one is named."""
    hit = [bool(answer(c)[1]) and set(answer(c)[1]) <= set(rotors(c["condition"]))
           for c in table if rotors(c["condition"])]
    return float(np.mean(hit)) if hit else float("nan")


def large_exact_rotors(table: list[dict]) -> float:
    """`exact_rotors` of the flights with at least LEAST_MM gone of a rotor."""
    return exact_rotors([c for c in table if large(c["condition"])])


def large_only_damaged_rotors(table: list[dict]) -> float:
    """`only_damaged_rotors` of the flights with at least LEAST_MM gone of a rotor."""
    return only_damaged_rotors([c for c in table if large(c["condition"])])


def severity(table: list[dict]) -> float:
    """Spearman's rank correlation of thrust_loss (0 where none is named) with the millimetres cut."""
    pairs = [(cut_mm(c["condition"]), answer(c)[2]) for c in table if np.isfinite(cut_mm(c["condition"]))]
    return float(spearmanr(*zip(*pairs, strict=True)).statistic) if len(pairs) > 2 else float("nan")


FEWEST = 6  #: flights from which the severity of a drone's rotor is printed: two conditions of three flights
#: figure's name -> function of the cases
FIGURES: dict[str, Callable[[list[dict]], float]] = {
    "balanced accuracy of the family": balanced_accuracy,
    f"the same, a cut under {LEAST_MM} mm may be normal": forgiven,
    "damaged rotors named exactly": exact_rotors, "only damaged rotors named": only_damaged_rotors,
    f"exactly, of at least {LEAST_MM} mm off a rotor": large_exact_rotors,
    f"only damaged, of at least {LEAST_MM} mm off a rotor": large_only_damaged_rotors,
    "severity, Spearman": severity}


def print_answers(table: list[dict]) -> None:
    """Print answers by family and by condition, and FIGURES with their intervals."""
    columns = (*FAMILIES, "unknown", "other")
    print(f"\n{'true family':14s} " + " ".join(f"{c:>13s}" for c in columns))
    for f in FAMILIES:
        answers = [answer(c)[0] for c in table if family(c["condition"]) == f]
        print(f"{f:14s} " + " ".join(f"{answers.count(c):13d}" for c in columns))
    print("\ncondition, drone: family named; rotors; summed thrust loss")
    for key in sorted({(c["condition"], c["drone"]) for c in table}):
        group = [answer(c) for c in table if (c["condition"], c["drone"]) == key]
        print(f"  {key[0]:52s} {key[1]} " + "; ".join(
            g[0] + (f" {g[1]} {g[2]:.2f}" if g[1] else "") for g in group))
    print(f"\n{len(table)} flights; 90 % intervals, conditions resampled")
    for text, figure in FIGURES.items():
        print(f"{text:48s} {with_interval(table, figure, 3)}")
    for drone in sorted({c["drone"] for c in table}):
        for which in ("M1", "M3"):
            part = [c for c in table if c["drone"] == drone and c["condition"].startswith("cut")
                    and ("_M1_" in c["condition"]) == (which == "M1")]
            if len(part) >= FEWEST:
                cut = "M2 and M1" if which == "M1" else "M3"
                print(f"severity, {drone}, {cut} cut: {severity(part):.3f} ({len(part)} flights)")
