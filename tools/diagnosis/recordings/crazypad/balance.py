"""What the balance of the motors in hover tells of CrazyPAD's labels: change by a cut, scatter, rotor and family.

`tools/diagnosis/gap_crazypad_balance.py` prints it and says what is fitted and tested.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import permutations

import numpy as np
from scipy.optimize import least_squares, minimize_scalar
from scipy.stats import t as student

from airtouch.gap.balance import hover_balance
from airtouch.gap.balance.hover_hypotheses import commanded_change, hypotheses
from airtouch.gap.balance.hover_pattern import LEAST_POWER, HoverPattern
from airtouch.gap.balance.priors import PRIORS, STEADY
from airtouch.vehicle import Vehicle

from . import labels
from .figures import FAMILY_OF
from .patterns import likeliest

DRAWS = 4000  #: of the scatter, for the expected fraction of right rotors; no source: round number, good to 0.01
FLIGHTS = 400  #: drawn of each family; no source: round number, good to 0.03
SMALL = 2.0  #: times the variance of one set of propellers in each axis: what two sets differ by
MOST_MAINTENANCE = 0.1  #: upper bound of the scatter of vehicles after maintenance; no source: far above what was found
Condition = tuple[str, str]  #: drone and what was done to it


def change(cut: dict[int, float], slope: float, yaw: float) -> np.ndarray:
    """Change (4,) of the balance where so many millimetres are cut off these rotors.

    slope: growth of a rotor's commanded thrust, 1/mm. yaw: ratio of the change of
    yaw to that of a rotor whose torque follows its thrust.
    """
    command = np.ones(4)
    for rotor, mm in cut.items():
        command[rotor - 1] += slope * mm
    return commanded_change(command[None])[0] * (1.0, 1.0, 1.0, yaw)


def fit(means: np.ndarray, cuts: list[dict[int, float]]) -> tuple[np.ndarray, np.ndarray]:
    """Slope and yaw ratio (2,) that fit the balances (conditions, 4) best, and their residuals (conditions, 4)."""
    def residuals(x: np.ndarray) -> np.ndarray:
        """Residuals (conditions, 4) with slope and yaw ratio x."""
        return np.array([m - change(c, *x) for m, c in zip(means, cuts, strict=True)])

    solution = least_squares(lambda x: residuals(x).ravel(), (0.03, 1.0)).x
    return solution, residuals(solution)


def maintenance(residuals: np.ndarray, nominal: np.ndarray, freedom: float) -> np.ndarray:
    """Scatter (4,) beside the nominal variances (conditions, 4) that makes the residuals (conditions, 4) likeliest.

    Roll and pitch have one, as the vehicle is symmetric; the tail is Student's, as the diagnosis takes it.
    """
    def scatter(columns: list[int]) -> float:
        """The likeliest scatter of these columns together."""
        def minus_log(extra: float) -> float:
            """Minus the log likelihood of a scatter."""
            width = np.sqrt(nominal[:, columns] + extra ** 2)
            return -float((student.logpdf(residuals[:, columns] / width, freedom) - np.log(width)).sum())
        return float(minimize_scalar(minus_log, bounds=(0.0, MOST_MAINTENANCE), method="bounded").x)

    sides = scatter([1, 2])
    return np.array([scatter([0]), sides, sides, scatter([3])])


class Balances:
    """Balances of the flights over the drone's normal ones.

    bases: by drone; difference (flights, 6): over all normal flights of the drone; pairs: conditions with cut blades.
    """

    def __init__(self, rows: Sequence[dict[str, str]], patterns: list[HoverPattern]) -> None:
        drone, normal = [r["drone"] for r in rows], np.array([labels.family(r["condition"]) == "normal" for r in rows])
        self.bases = {d: hover_balance.reference([patterns[i] for i in np.flatnonzero(normal & (np.array(drone) == d))])
                      for d in sorted(set(drone))}
        self.difference = np.array([self.bases[d].difference(p) for d, p in zip(drone, patterns, strict=True)])
        self.of = [(r["drone"], r["condition"]) for r in rows]
        self.pairs = sorted({p for p in self.of if np.isfinite(labels.cut_mm(p[1]))})
        self.cuts = [labels.millimetres(condition) for _, condition in self.pairs]
        self.means = np.array([self.own(p).mean(axis=0) for p in self.pairs])

    def own(self, pair: Condition) -> np.ndarray:
        """Differences (flights, 4) of one condition."""
        return self.difference[[p == pair for p in self.of], hover_balance.BALANCE]

    def within(self) -> np.ndarray:
        """Standard deviation (4,) between the flights of a condition."""
        each = [self.own(p) - self.own(p).mean(axis=0) for p in sorted(set(self.of))]
        return np.sqrt((np.concatenate(each) ** 2).sum(axis=0) / sum(len(e) - 1 for e in each))

    def nominal(self) -> np.ndarray:
        """Variances (conditions, 4) between the normal flights of each condition's drone."""
        return np.array([self.bases[drone].variance[hover_balance.BALANCE] for drone, _ in self.pairs])


def _rivals(cut: dict[int, float]) -> Iterator[dict[int, float]]:
    """The same millimetres on as many rotors, in every way."""
    for rotors in permutations((1, 2, 3, 4), len(cut)):
        yield dict(zip(rotors, cut.values(), strict=True))


@dataclass(frozen=True)
class RotorTest:
    """A condition as a test of the rotor sees it.

    small: whether the cut changes less than two sets of propellers differ; expected: fraction right, if residuals are
    normal; sides, hits (flights,): whether the change is to the predicted side, the rotors right; mm (flights,): of
    the cut, as measured.
    """

    pair: Condition
    small: bool
    expected: float
    sides: np.ndarray
    hits: np.ndarray
    mm: np.ndarray


def rotor_tests(b: Balances) -> list[RotorTest]:
    """Each condition with cut blades, change and scatter fitted to the others."""
    out, generator = [], np.random.default_rng(0)
    for k, pair in enumerate(b.pairs):
        rest = np.arange(len(b.pairs)) != k
        solution, residuals = fit(b.means[rest], [c for c, r in zip(b.cuts, rest, strict=True) if r])
        whiten = np.linalg.inv(np.linalg.cholesky(residuals.T @ residuals / (rest.sum() - 2))).T
        out.append(rotor_test(pair, b.own(pair), solution, whiten, generator))
    return out


def rotor_test(pair: Condition, balances: np.ndarray, solution: np.ndarray, whiten: np.ndarray,
               generator: np.random.Generator) -> RotorTest:
    """The test of one condition's balances (flights, 4).

    solution: slope and yaw ratio (2,) of `fit`; whiten (4, 4): makes the scatter of balances that of unit noise.
    """
    cut = labels.millimetres(pair[1])
    rivals = np.array([change(c, *solution) for c in _rivals(cut)]) @ whiten
    right = np.array([set(c) == set(cut) for c in _rivals(cut)])
    true = change(cut, *solution) @ whiten
    samples, own = true + generator.standard_normal((DRAWS, 4)), balances @ whiten
    return RotorTest(pair, bool(true @ true < SMALL * len(true)), float(right[_nearest(samples, rivals)].mean()),
                     own @ true > 0.0, right[_nearest(own, rivals)], own @ true / (true @ true) * sum(cut.values()))


def _nearest(balances: np.ndarray, rivals: np.ndarray) -> np.ndarray:
    """Index (n,) of the rival (rivals, 4) nearest to each balance (n, 4)."""
    return ((balances[:, None] - rivals) ** 2).sum(axis=2).argmin(axis=1)


def drawn_pattern(kind: str, changes: np.ndarray, variance: np.ndarray,
                  generator: np.random.Generator) -> HoverPattern:
    """A flight of a family, drawn from the priors of the diagnosis.

    changes (n, 4): of the balance, one of which the flight has; variance (6,): of the drone's normal flights.
    """
    balance = changes[generator.integers(len(changes))]
    scatter = PRIORS.maintenance if kind != "normal" or generator.random() < 0.5 else np.zeros(4)
    width = np.sqrt(variance[hover_balance.BALANCE] + np.array(scatter) ** 2)
    balance = balance + width * generator.standard_t(PRIORS.freedom, 4)
    power_change = PRIORS.damaged if kind == "rotor damage" else STEADY
    power = [generator.normal(m, np.hypot(s, np.sqrt(v)))
             for (m, s), v in zip(power_change, variance[hover_balance.POWER], strict=True)]
    return HoverPattern(balance, np.array(power), np.full(2, LEAST_POWER))


def family_shares(b: Balances, vehicle: Vehicle) -> Iterator[tuple[str, dict[str, float]]]:
    """Each drone, with the fraction of each family's drawn flights that the diagnosis names right."""
    generator, candidates = np.random.default_rng(0), hypotheses(vehicle)
    families = [{"none": "normal", **FAMILY_OF}.get(h.name, h.name) for h in candidates]
    solution, _ = fit(b.means, b.cuts)
    cuts = [change(c, *solution) for c, (_, text) in zip(b.cuts, b.pairs, strict=True) if labels.large(text)]
    changes_of = {"normal": np.zeros((1, 4)), "rotor damage": np.array(cuts),
                  "added weight": next(h.change for h in candidates if h.name == "mass"),
                  "slung load": next(h.change for h in candidates if h.name == "slung_load")}
    for drone, base in b.bases.items():
        reference = hover_balance.Reference(np.zeros(6), base.variance, np.zeros(2))
        right = {}
        for kind, changes in changes_of.items():
            patterns = (drawn_pattern(kind, changes, base.variance, generator) for _ in range(FLIGHTS))
            right[kind] = float(np.mean([
                likeliest(hover_balance.evidence(reference.difference(p), reference, candidates)[0], families) == kind
                for p in patterns]))
        yield drone, right
