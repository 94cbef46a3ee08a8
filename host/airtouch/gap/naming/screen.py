"""A first look at every candidate: its first-order change of the spectra, fitted by least squares.

One replay for each free parameter, shared by both halves of the data; candidates that do
well here are then fitted in full.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from airtouch.gap.evidence.data import Data, spectra
from airtouch.gap.evidence.fit import PRIOR_UNITS, strongest
from airtouch.gap.evidence.least_squares import bounded_step, limits, weights_of, without_offsets
from airtouch.gap.evidence.problem import Part, Problem, problem_of
from airtouch.gap.signatures.signature import MEAN
from airtouch.gap.signatures.term import Term

STEP = 0.25  #: of a parameter's natural step, at which the change is taken; chosen
ROUNDS = 3  #: of least squares, each with the weights of what the one before left; chosen
NOTHING = 1e-9  #: change of a spectrum, unit/sqrt(Hz), that is none; chosen, far above rounding
UNBOUNDED = 1e6  #: scaled parameter up to which the effects beside may give way: any


@dataclass
class Screen:
    """Changes of the spectra by effect and parameter, made when first asked for.

    judged: by the identity of an array of residuals, that array with the results of `before`.
    """

    data: Data
    judged: dict[int, tuple[np.ndarray, float, float]] = field(default_factory=dict)

    def column(self, problem: Problem, term: Term, i: int) -> np.ndarray:
        """Change (n,) of the flattened spectra per scaled parameter i of a term at neutral."""
        gathered = problem.layout.gather(self._change(term, i))
        return np.where(problem.known, problem.with_commands(gathered), 0.0)

    def _change(self, term: Term, i: int) -> list[dict[str, np.ndarray]]:
        """Change of the spectra by flight and regime; made once."""
        def make() -> list[dict[str, np.ndarray]]:
            low, high = term.bounds()
            x = np.zeros(len(term.free))
            x[i] = STEP if STEP <= high[i] else -STEP
            neutral = [term.active(np.zeros(len(term.free)))]
            before = spectra(self.data, neutral) if term.acts_when_neutral else self.data.base
            after = spectra(self.data, [term.active(x)])
            return [{r: ((a[r] - b[r]) / x[i]).astype(np.complex64) for r in a}
                    for a, b in zip(after, before, strict=True)]

        return self.data.workspace.once("change", _key(term, term.free[i]), make)

    def shows(self, term: Term) -> bool:
        """Whether a term changes what the logged commands lead to expect.

        An effect of the closed loop, such as another gain, leaves no trace there: the commands alone show it.
        """
        return any(np.abs(v).max(initial=0.0) > NOTHING for i in range(len(term.free))
                   for flight in self._change(term, i) for v in flight.values())

    def before(self, problem: Problem, residuals: np.ndarray, extra_power: np.ndarray) -> tuple[float, float]:
        """Log likelihood of residuals (n,), offsets taken off, and nats that these cost; once for each array."""
        known = self.judged.get(id(residuals))
        if known is None or known[0] is not residuals:
            values, cost = without_offsets(problem, residuals, extra_power)
            known = self.judged[id(residuals)] = (residuals, problem.likelihood(values, extra_power), cost)
        return known[1:]


def first_order(screen: Screen, parts: Sequence[Part], residuals: Sequence[np.ndarray],
                extra_power: Sequence[np.ndarray], terms: Sequence[Term],
                beside: Sequence[Term] = ()) -> tuple[float, list[np.ndarray], list[np.ndarray]]:
    """Held-out gain of mean effects to first order, nats, their scaled parameters (k,) on each half, and the variances.

    residuals, extra_power: for each part the flattened values (n,) that the effects chosen before leave, and the power
    (n,) that random ones add. beside: those effects, free to give way a little.
    """
    mean, other = ([t for t in some if t.kind == MEAN and not t.signature.commands_only] for some in (terms, beside))
    tables = [_columns(screen, part, (*mean, *other)) for part in parts]
    n = sum(len(t.free) for t in mean)
    bounds = _bounds(mean, len(tables[0]) - n)
    gain, fitted, variances = 0.0, [], []
    for train, test in ((0, 1), (1, 0)):
        problem = problem_of(screen.data, parts[train])
        x, variance = _least_squares(problem, tables[train], residuals[train], extra_power[train], bounds)
        problem = problem_of(screen.data, parts[test])
        moved = sum((a * c for a, c in zip(x, tables[test], strict=True)), np.zeros(len(residuals[test])))
        after, cost = without_offsets(problem, residuals[test] + moved, extra_power[test])
        before, paid = screen.before(problem, residuals[test], extra_power[test])
        gain += problem.likelihood(after, extra_power[test]) - cost - before + paid
        fitted.append(x[:n])
        variances.append(variance[:n])
    return gain, fitted, variances


def _columns(screen: Screen, part: Part, terms: Sequence[Term]) -> list[np.ndarray]:
    """Change (n,) of the flattened spectra of a part per scaled parameter, for all free parameters of some terms."""
    problem = problem_of(screen.data, part)
    return [screen.column(problem, t, i) for t in terms for i in range(len(t.free))]


def _bounds(mean: Sequence[Term], others: int) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest scaled parameters of mean effects, followed by so many that are free."""
    low, high = limits(mean)
    wide = np.full(others, UNBOUNDED)
    return np.concatenate([low, -wide]), np.concatenate([high, wide])


def _least_squares(problem: Problem, table: Sequence[np.ndarray], residual: np.ndarray, extra_power: np.ndarray,
                   bounds: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Scaled parameters (k,) whose changes (n,) of a table explain a residual (n,) best, and their variances (k,)."""
    size, constants = len(table), problem.unit_offsets
    columns = np.array([*table, *(-c for c, _ in constants)])
    prior = np.concatenate([np.full(size, PRIOR_UNITS), [deviation for _, deviation in constants]])
    x, offsets = np.zeros(size), np.zeros(len(constants))
    nothing = (np.zeros(size), np.zeros((size, size)))
    values = residual
    for _ in range(ROUNDS):
        change, covariance = bounded_step(columns, prior, values, weights_of(problem, values, extra_power),
                                          x, offsets, *bounds, nothing)
        x = np.clip(x + change[:size], *bounds)
        offsets = offsets + change[size:]
        values = residual + np.concatenate([x, offsets]) @ columns
    return x, np.diag(covariance)


def random_look(screen: Screen, parts: Sequence[Part], residuals: Sequence[np.ndarray],
                extra_power: Sequence[np.ndarray], term: Term) -> tuple[float, np.ndarray]:
    """Held-out nats of a random effect beside what is chosen, which stays as it is, and its scaled strength (k,).

    residuals, extra_power: as for `first_order`.
    """
    gain, strengths = 0.0, []
    for train, test in ((0, 1), (1, 0)):
        problem, other = (problem_of(screen.data, parts[k]) for k in (train, test))
        found = strongest(problem, term, residuals[train], extra_power[train])
        rest, before = residuals[test], extra_power[test]
        gain += other.likelihood(rest, before + other.random_power([found])) - other.likelihood(rest, before)
        strengths.append(found.scaled(found.values))
    return gain, np.mean(strengths, axis=0)


def _key(term: Term, parameter: str) -> tuple:
    """What a column is kept by: the effect's variant and the parameter that is moved."""
    return term.name, parameter, tuple(sorted((k, v) for k, v in term.values.items() if k not in term.free))
