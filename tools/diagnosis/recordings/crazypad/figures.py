"""Figures of CrazyPAD's diagnoses: family, rotors and severity against the labels, with 90 % intervals.

A result is a flight's diagnosis with its labels: drone, condition, verdict, effects (`Diagnosis.plain`).
"""

from collections.abc import Callable

import numpy as np
from scipy.stats import spearmanr

from airtouch.detector.evaluation.bootstrap import resampled

from ..result_store import Result
from .labels import FAMILIES, LEAST_MM, cut_mm, family, large, millimetres, rotors

#: effect that a diagnosis names -> family
FAMILY_OF = {"weak_motor": "rotor damage", "mass": "added weight", "com_offset": "added weight",
             "slung_load": "slung load"}
#: a diagnosis that names rotor damage, of no rotor
ROTOR_DAMAGE: dict = {"verdict": "effect", "effects": [
    {"name": "weak_motor", "parameters": {"rotor": {"value": 0}, "thrust_loss": {"value": 0.0}}}]}
RESAMPLES = 2000  #: bootstrap samples; no source: round number, which gives an interval to 0.01 or so


def answer(result: Result) -> str:
    """The family that a diagnosis names first; `unknown`, `other` or `refused` where it names none."""
    if result["verdict"] == "effect":
        return FAMILY_OF.get(result["effects"][0]["name"], "other")
    return "normal" if result["verdict"] == "none" else result["verdict"]


def named_rotors(result: Result) -> list[int]:
    """The rotors that a diagnosis names as weak."""
    return sorted(round(p["rotor"]["value"]) for p in _weak_motors(result))


def thrust_loss(result: Result) -> float:
    """The loss of thrust that a diagnosis names, summed over rotors; 0 where it names none."""
    return sum(p["thrust_loss"]["value"] for p in _weak_motors(result))


def _weak_motors(result: Result) -> list[dict]:
    """The parameters of each weak motor that a diagnosis names."""
    effects = result["effects"] if result["verdict"] == "effect" else []
    return [e["parameters"] for e in effects if e["name"] == "weak_motor"]


def balanced_accuracy(table: list[Result]) -> float:
    """Mean over families of the fraction named right; families without flights are left out."""
    fractions = []
    for f in FAMILIES:
        hits = [answer(r) == f for r in table if family(r["condition"]) == f]
        fractions += [np.mean(hits)] if hits else []
    return float(np.mean(fractions)) if fractions else float("nan")


def interval(table: list[Result], figure: Callable[[list[Result]], float]) -> tuple[float, float]:
    """90 % interval of a figure, resampling conditions (of a drone) within families."""
    groups: dict[str, dict[str, list[Result]]] = {}
    for r in table:
        groups.setdefault(family(r["condition"]), {}).setdefault(r["drone"] + r["condition"], []).append(r)
    families = [list(conditions.values()) for conditions in groups.values()]

    def figure_of(*picks: np.ndarray) -> float:
        """The figure of a sample: the numbers of the conditions that it has of each family."""
        return figure([result for conditions, pick in zip(families, picks, strict=True)
                       for k in pick for result in conditions[k]])

    low, high = resampled(figure_of, *map(len, families), replicates=RESAMPLES, level=0.9)
    return low, high


def with_interval(table: list[Result], figure: Callable[[list[Result]], float], digits: int = 2,
                  label: str = "") -> str:
    """A figure and, behind a label, its 90 % interval, as text; "-" where the figure is NaN, as of too few flights."""
    value = figure(table)
    if np.isnan(value):
        return "-"
    low, high = interval(table, figure)
    return f"{value:.{digits}f} ({label}{low:.{digits}f} to {high:.{digits}f})"


def forgiven(table: list[Result]) -> float:
    """`balanced_accuracy`, where a cut of less than LEAST_MM may be called normal."""
    def is_excused(r: Result) -> bool:
        """Whether a small cut was called normal."""
        return bool(millimetres(r["condition"])) and not large(r["condition"]) and answer(r) == "normal"

    return balanced_accuracy([r for r in table if not is_excused(r)]
                             + [{**r, **ROTOR_DAMAGE} for r in table if is_excused(r)])


def exact_rotors(table: list[Result]) -> float:
    """Share of rotor-damage flights for which exactly the damaged rotors are named."""
    hit = [named_rotors(r) == rotors(r["condition"]) for r in table if rotors(r["condition"])]
    return float(np.mean(hit)) if hit else float("nan")


def only_damaged_rotors(table: list[Result]) -> float:
    """Share of rotor-damage flights for which a damaged rotor and no sound one is named."""
    hit = [bool(named_rotors(r)) and set(named_rotors(r)) <= set(rotors(r["condition"]))
           for r in table if rotors(r["condition"])]
    return float(np.mean(hit)) if hit else float("nan")


def large_exact_rotors(table: list[Result]) -> float:
    """`exact_rotors` of the flights with at least LEAST_MM gone of a rotor."""
    return exact_rotors([r for r in table if large(r["condition"])])


def large_only_damaged_rotors(table: list[Result]) -> float:
    """`only_damaged_rotors` of the flights with at least LEAST_MM gone of a rotor."""
    return only_damaged_rotors([r for r in table if large(r["condition"])])


def severity(table: list[Result]) -> float:
    """Spearman's rank correlation of thrust_loss (0 where none is named) with the millimetres cut.

    NaN of fewer than three flights, and where all have the same loss or cut.
    """
    pairs = [(cut_mm(r["condition"]), thrust_loss(r)) for r in table if np.isfinite(cut_mm(r["condition"]))]
    if len(pairs) < 3 or any(len(set(column)) == 1 for column in zip(*pairs, strict=True)):
        return float("nan")
    return float(spearmanr(*zip(*pairs, strict=True)).statistic)


FEWEST = 6  #: flights from which the severity of a drone's rotor is printed: two conditions of three flights
#: figure's name -> function of the results
FIGURES: dict[str, Callable[[list[Result]], float]] = {
    "balanced accuracy of the family": balanced_accuracy,
    f"the same, a cut under {LEAST_MM} mm may be normal": forgiven,
    "damaged rotors named exactly": exact_rotors, "only damaged rotors named": only_damaged_rotors,
    f"exactly, of at least {LEAST_MM} mm off a rotor": large_exact_rotors,
    f"only damaged, of at least {LEAST_MM} mm off a rotor": large_only_damaged_rotors,
    "severity, Spearman": severity}


def print_figures(table: list[Result]) -> None:
    """Print answers by family and by condition, and FIGURES with their intervals."""
    columns = (*FAMILIES, "unknown", "other")
    print(f"\n{'true family':14s} " + " ".join(f"{c:>13s}" for c in columns))
    for f in FAMILIES:
        answers = [answer(r) for r in table if family(r["condition"]) == f]
        print(f"{f:14s} " + " ".join(f"{answers.count(c):13d}" for c in columns))
    print("\ncondition, drone: family named; rotors; summed thrust loss")
    for key in sorted({(r["condition"], r["drone"]) for r in table}):
        group = [r for r in table if (r["condition"], r["drone"]) == key]
        print(f"  {key[0]:52s} {key[1]} " + "; ".join(
            answer(r) + (f" {named_rotors(r)} {thrust_loss(r):.2f}" if named_rotors(r) else "") for r in group))
    print(f"\n{len(table)} flights; 90 % intervals, conditions resampled")
    for text, figure in FIGURES.items():
        print(f"{text:48s} {with_interval(table, figure, 3)}")
    for drone in sorted({r["drone"] for r in table}):
        for which in ("M1", "M3"):
            part = [r for r in table if r["drone"] == drone and r["condition"].startswith("cut")
                    and ("_M1_" in r["condition"]) == (which == "M1")]
            if len(part) >= FEWEST:
                cut = "M2 and M1" if which == "M1" else "M3"
                print(f"severity, {drone}, {cut} cut: {severity(part):.3f} ({len(part)} flights)")
