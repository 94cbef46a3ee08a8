"""What the balance of the motors in hover can tell on CrazyPAD at all: of the rotor, and of the family.

    python tools/gap_crazypad_balance.py [FOLDER] [--part build|all]

One change for a millimetre cut off a rotor is fitted to all conditions with cut blades, told their labels. What is left
is how a vehicle differs that was worked on: another set of propellers, for the most part. `Beliefs.worked_on` is this
scatter in the building conditions. Then
- a test of the rotor that is told how many rotors were cut, how much of each, and change and scatter of the other
  conditions; it only chooses which rotors. Severity is then measured along the right rotors' change.
- the diagnosis itself on drawn flights whose changes and scatter are what it believes: no test on the same six
  numbers is right more often in the mean of the families. Cut rotors are drawn from the conditions of at least 1.5 mm.
"""

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import permutations
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
import numpy as np
from scipy.optimize import least_squares, minimize_scalar
from scipy.stats import spearmanr
from scipy.stats import t as student

import gap_crazypad as pad
from airtouch import vehicle as vehicles
from airtouch.gap.balance import hover_balance
from airtouch.gap.flights.flight import ready
from airtouch.logs import read

DRAWS = 4000
FLIGHTS = 400  #: drawn of each family
AXES = "lift, roll, pitch, yaw"
Condition = tuple[str, str]  #: drone and what was done to it


def change(cut: dict[int, float], slope: float, yaw: float) -> np.ndarray:
    """Change (4,) of the balance where so many millimetres are cut off these rotors: one more told by slope a mm.

    yaw: ratio of the change of yaw to that of a rotor whose torque follows its thrust.
    """
    told = np.ones(4)
    for rotor, mm in cut.items():
        told[rotor - 1] += slope * mm
    mixed = hover_balance.MIX @ told
    return np.array([np.log(mixed[0]), *(mixed[1:] / mixed[0] * (1.0, 1.0, yaw))])


def fitted(means: np.ndarray, cuts: list[dict[int, float]]) -> tuple[np.ndarray, np.ndarray]:
    """Slope and yaw ratio (2,) that fit the balances (conditions, 4) best, and what is left (conditions, 4)."""
    def left(x: np.ndarray) -> np.ndarray:
        return np.array([m - change(c, *x) for m, c in zip(means, cuts, strict=True)])

    found = least_squares(lambda x: left(x).ravel(), (0.03, 1.0)).x
    return found, left(found)


def worked_on(left: np.ndarray, nominal: np.ndarray, freedom: float) -> np.ndarray:
    """Scatter (4,) beside the nominal variances (conditions, 4) that makes what is left likeliest.

    Roll and pitch have one, as the vehicle is symmetric; the tail is Student's, as the diagnosis takes it.
    """
    def scatter(columns: list[int]) -> float:
        def minus_log(extra: float) -> float:
            width = np.sqrt(nominal[:, columns] + extra ** 2)
            return -float((student.logpdf(left[:, columns] / width, freedom) - np.log(width)).sum())
        return float(minimize_scalar(minus_log, bounds=(0.0, 0.1), method="bounded").x)

    sides = scatter([1, 2])
    return np.array([scatter([0]), sides, sides, scatter([3])])


class Balances:
    """Balances of the flights over the drone's normal ones.

    bases: by drone; difference (flights, 6): over all normal flights of the drone; pairs: conditions with cut blades.
    """

    def __init__(self, folder: Path, part: str) -> None:
        rows = pad.manifest(folder, part)
        self.vehicle = vehicles.load("crazyflie-2.1")
        table = np.array([hover_balance.pattern(ready(read(folder / r["file"]), self.vehicle), self.vehicle)
                          for r in rows])
        drone, normal = [r["drone"] for r in rows], np.array([pad.family(r["condition"]) == "normal" for r in rows])
        self.bases = {d: hover_balance.reference(table[normal & (np.array(drone) == d)]) for d in sorted(set(drone))}
        self.difference = np.array([self.bases[d].difference(p) for d, p in zip(drone, table, strict=True)])
        self.of = [(r["drone"], r["condition"]) for r in rows]
        self.pairs = sorted({p for p in self.of if np.isfinite(pad.cut_mm(p[1]))})
        self.cuts = [pad.millimetres(condition) for _, condition in self.pairs]
        self.means = np.array([self.own(p).mean(axis=0) for p in self.pairs])

    def own(self, pair: Condition) -> np.ndarray:
        """Differences (flights, 4) of one condition."""
        return self.difference[[p == pair for p in self.of], :4]


def show_scatter(b: Balances) -> None:
    """The fit, what is left, and the `worked_on` that follows."""
    (slope, yaw), left = fitted(b.means, b.cuts)
    each = [b.own(p) - b.own(p).mean(axis=0) for p in sorted(set(b.of))]
    within = np.sqrt((np.concatenate(each) ** 2).sum(axis=0) / sum(len(e) - 1 for e in each))
    print(f"{len(b.pairs)} conditions with cut blades: {100 * slope:.1f} % more told to a rotor for each mm, "
          f"yaw {yaw:.2f} of what follows from it")
    beliefs = hover_balance.BELIEFS
    nominal = np.array([b.bases[drone].variance[:4] for drone, _ in b.pairs])
    for text, values in (("between flights of a condition", within),
                         ("left of the conditions, rms", np.sqrt((left ** 2).mean(axis=0))),
                         ("worked_on that makes these likeliest", worked_on(left, nominal, beliefs.freedom))):
        print(f"{text}, {AXES}: " + ", ".join(f"{100 * v:.1f} %" for v in values))


def _rivals(cut: dict[int, float]) -> Iterator[dict[int, float]]:
    """The same millimetres on as many rotors, in every way."""
    for rotors in permutations((1, 2, 3, 4), len(cut)):
        yield dict(zip(rotors, cut.values(), strict=True))


@dataclass(frozen=True)
class Told:
    """A condition as a test of the rotor sees it.

    small: whether the cut changes less than two sets of propellers differ; expected: share right, if what is left is
    normal; sides, hits (flights,): whether the change is to the predicted side, the rotors right; mm (flights,): of
    the cut, as measured.
    """

    pair: Condition
    small: bool
    expected: float
    sides: np.ndarray
    hits: np.ndarray
    mm: np.ndarray


def rotor_tests(b: Balances) -> list[Told]:
    """Each condition with cut blades, change and scatter fitted to the others."""
    out, generator = [], np.random.default_rng(0)
    for k, (pair, cut) in enumerate(zip(b.pairs, b.cuts, strict=True)):
        rest = np.arange(len(b.pairs)) != k
        found, left = fitted(b.means[rest], [c for c, r in zip(b.cuts, rest, strict=True) if r])
        whiten = np.linalg.inv(np.linalg.cholesky(left.T @ left / (rest.sum() - 2))).T
        rivals = np.array([change(c, *found) for c in _rivals(cut)]) @ whiten
        right, true = np.array([set(c) == set(cut) for c in _rivals(cut)]), change(cut, *found) @ whiten
        drawn, own = true + generator.standard_normal((DRAWS, 4)), b.own(pair) @ whiten
        out.append(Told(pair, bool(true @ true < 2.0 * len(true)), float(right[_nearest(drawn, rivals)].mean()),
                        own @ true > 0.0, right[_nearest(own, rivals)], own @ true / (true @ true) * sum(cut.values())))
    return out


def show_rotor(tests: list[Told]) -> None:
    """What the balance says of which rotor was cut, to a test that is told the rest."""
    print("\n| cut | flights | the cut changes less than two sets of propellers differ | changed to the predicted "
          "side | exact rotors, told their number and the mm | expected of these | severity, told the rotors |\n"
          "|---|---|---|---|---|---|---|")
    for text, large in (("all", False), ("at least 1.5 mm off a rotor", True)):
        some = [t for t in tests if not large or pad.large(t.pair[1])]
        flights = sum(len(t.hits) for t in some)
        small, sides = sum(len(t.hits) for t in some if t.small), sum(int(t.sides.sum()) for t in some)
        expected = sum(t.expected * len(t.hits) for t in some) / flights
        print(f"| {text} | {flights} | {small} | {sides} | {_shown(some, _right)} | {expected:.2f} | "
              f"{_shown(some, _severity)} |")
    for t in tests:
        print(f"  {' '.join(t.pair):55s} {t.hits.sum()} of {len(t.hits)}, expected {t.expected:.2f}"
              f"{', small' if t.small else ''}")


def _right(some: Sequence[Told]) -> float:
    return float(np.concatenate([t.hits for t in some]).mean())


def _severity(some: Sequence[Told]) -> float:
    true = np.concatenate([np.full(len(t.mm), pad.cut_mm(t.pair[1])) for t in some])
    return float(spearmanr(np.concatenate([t.mm for t in some]), true).statistic)


def _shown(some: Sequence[Told], figure: Callable[[Sequence[Told]], float]) -> str:
    """A figure with its 90 % interval, conditions resampled."""
    drawn = np.random.default_rng(0).integers(0, len(some), (pad.RESAMPLES, len(some)))
    low, high = np.nanpercentile([figure([some[i] for i in row]) for row in drawn], (5, 95))
    return f"{figure(some):.2f} ({low:.2f} to {high:.2f})"


def _nearest(seen: np.ndarray, rivals: np.ndarray) -> np.ndarray:
    return ((seen[:, None] - rivals) ** 2).sum(axis=2).argmin(axis=1)


def show_family(b: Balances) -> None:
    """The diagnosis on drawn flights of each family that are as it believes."""
    generator, beliefs = np.random.default_rng(0), hover_balance.BELIEFS
    hypotheses = hover_balance.hypotheses(b.vehicle)
    found, _ = fitted(b.means, b.cuts)
    cuts = np.array([change(c, *found) for c, (_, text) in zip(b.cuts, b.pairs, strict=True) if pad.large(text)])
    kinds = {"normal": [np.zeros((1, 4))], "rotor damage": [cuts],
             "added weight": [h.change for h in hypotheses if h.name == "mass"],
             "slung load": [h.change for h in hypotheses if h.name == "slung_load"]}
    print(f"\nthe diagnosis on {FLIGHTS} drawn flights of each family, which are as it believes")
    for drone, base in b.bases.items():
        reference = hover_balance.Reference(np.zeros(6), base.variance, np.zeros(2))
        right = {}
        for kind, (changes,) in kinds.items():
            names = []
            for _ in range(FLIGHTS):
                seen = np.concatenate([changes[generator.integers(len(changes))], np.zeros(2), [-9.0, -9.0]])
                worked = beliefs.worked_on if kind != "normal" or generator.random() < 0.5 else np.zeros(4)
                width = np.sqrt(base.variance[:4] + np.array(worked) ** 2)
                seen[:4] += width * generator.standard_t(beliefs.freedom, 4)
                manner = beliefs.damaged if kind == "rotor damage" else hover_balance.STEADY
                seen[4:6] = [generator.normal(m, np.hypot(s, np.sqrt(v)))
                             for (m, s), v in zip(manner, base.variance[4:], strict=True)]
                names.append(_family(hover_balance.evidence(seen, reference, hypotheses, beliefs)[0], hypotheses))
            right[kind] = np.mean([n == kind for n in names])
        print(f"{drone}: family, balanced {np.mean(list(right.values())):.2f}; "
              + ", ".join(f"{k} {v:.2f}" for k, v in right.items()))


def _family(logs: np.ndarray, hypotheses: list[hover_balance.Hypothesis]) -> str:
    """The likeliest family of a log evidence for each hypothesis."""
    chance: dict[str, float] = {}
    for h, p in zip(hypotheses, np.exp(logs - logs.max()), strict=True):
        name = {"none": "normal", **pad.FAMILY_OF}.get(h.name, h.name)
        chance[name] = chance.get(name, 0.0) + float(p)
    return max(chance, key=chance.__getitem__)


def main() -> None:
    options = pad.folder_and_part(__doc__)
    balances = Balances(options.folder, options.part)
    show_scatter(balances)
    show_rotor(rotor_tests(balances))
    show_family(balances)


if __name__ == "__main__":
    main()
