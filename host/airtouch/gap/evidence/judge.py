"""How likely some blocks of flights are under effects that were fitted elsewhere, in all and cell by cell."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from airtouch.gap.evidence.cells import CELLS
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.least_squares import without_offsets
from airtouch.gap.evidence.problem import BlockSet, Modelled, Problem, problem_of
from airtouch.gap.signatures.candidates import random_of
from airtouch.gap.signatures.term import Term

#: nats from which effects count as gaining in a cell; chosen. A larger number leaves out cells that an effect improves
#: a little, a smaller one takes in those in which it gains by chance
CELL_GAIN = 1.0


def judge(data: Data, part: BlockSet, terms: Sequence[Term], uncertain_floor: bool = False) -> float:
    """Log likelihood of blocks under effects fitted elsewhere; offsets between flights fitted anew.

    uncertain_floor: the commands' floor is as uncertain as under random effects, though there are none.
    """
    remainder = left_over(data, part, terms, uncertain_floor)
    return remainder.log_likelihood - remainder.cost


@dataclass(frozen=True, eq=False)
class LeftOver:
    """What effects leave of the gap in some blocks.

    problem: of the blocks; modelled: what the effects make of it; gap (n,): under them, offsets between flights
    subtracted; offset_cost: nats that the offsets cost.
    """

    problem: Problem
    modelled: Modelled
    gap: np.ndarray
    offset_cost: float

    @property
    def extra_power(self) -> np.ndarray:
        """Power (n,) that the effects add to that expected."""
        return self.modelled.extra_power

    @property
    def cost(self) -> float:
        """Nats that the offsets and the commands' floor cost."""
        return self.offset_cost + self.modelled.cost

    @cached_property
    def log_likelihood(self) -> float:
        """Log likelihood of the gap, without the cost."""
        return self.problem.likelihood(self.gap, self.extra_power)

    @property
    def power(self) -> np.ndarray:
        """Expected power (n,) of the gap."""
        return self.problem.elements.power + self.extra_power

    def log_likelihoods(self) -> np.ndarray:
        """Log likelihood (n,) of each value, without the cost."""
        return self.problem.likelihood.per_value(self.gap, self.extra_power)


def left_over(data: Data, part: BlockSet, terms: Sequence[Term], uncertain_floor: bool = False) -> LeftOver:
    """What effects with these parameters leave of the gap; offsets between flights fitted anew.

    uncertain_floor: see `judge`.
    """
    problem = problem_of(data, part)
    modelled = problem.modelled(terms, uncertain_floor)
    return LeftOver(problem, modelled, *without_offsets(problem, modelled.gap, modelled.extra_power))


def cell_gains(data: Data, part: BlockSet, terms: Sequence[Term]) -> np.ndarray:
    """Log likelihood (CELLS,) that effects with these parameters add in each cell: view, channel and band."""
    without = left_over(data, part, (), uncertain_floor=bool(random_of(terms)))
    gains = left_over(data, part, terms).log_likelihoods() - without.log_likelihoods()
    return np.bincount(without.problem.flat.cells, gains, CELLS)
