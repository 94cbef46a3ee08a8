"""How likely some blocks of flights are under effects that were fitted elsewhere, all together and cell by cell."""

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

#: nats that effects must gain in a cell for it to count as improved; chosen. A larger number leaves out cells that an
#: effect improves a little, a smaller one takes in those in which it gains by chance
CELL_GAIN = 1.0


def judge(data: Data, blocks: BlockSet, terms: Sequence[Term], uncertain_floor: bool = False) -> float:
    """Log likelihood of blocks under effects fitted elsewhere, nats; offsets between flights fitted anew.

    uncertain_floor: the commands' floor is as uncertain as under random effects, though there are none.
    """
    judged = judged_blocks(data, blocks, terms, uncertain_floor)
    return judged.log_likelihood - judged.cost


@dataclass(frozen=True, eq=False)
class JudgedBlocks:
    """Some blocks under effects with their values, and the residual that these leave.

    problem: of the blocks; modelled: the blocks under the effects, before offsets; residual (n,): offsets between
    flights subtracted, unit/sqrt(Hz); offset_cost: nats that the offsets cost.
    """

    problem: Problem
    modelled: Modelled
    residual: np.ndarray
    offset_cost: float

    @property
    def extra_power(self) -> np.ndarray:
        """Power (n,) that the effects add to the floor's, unit^2/Hz."""
        return self.modelled.extra_power

    @property
    def cost(self) -> float:
        """Nats that the offsets and the commands' floor cost."""
        return self.offset_cost + self.modelled.cost

    @cached_property
    def log_likelihood(self) -> float:
        """Log likelihood of the residual, nats, without the cost."""
        return self.problem.likelihood(self.residual, self.extra_power)

    @property
    def expected_power(self) -> np.ndarray:
        """Power (n,) that is expected of the residual, unit^2/Hz."""
        return self.problem.elements.floor_power + self.extra_power

    def log_likelihoods(self) -> np.ndarray:
        """Log likelihood (n,) of each value, without the cost."""
        return self.problem.likelihood.per_value(self.residual, self.extra_power)


def judged_blocks(data: Data, blocks: BlockSet, terms: Sequence[Term], uncertain_floor: bool = False) -> JudgedBlocks:
    """Some blocks under effects fitted elsewhere; offsets between flights fitted anew.

    uncertain_floor: see `judge`.
    """
    problem = problem_of(data, blocks)
    modelled = problem.modelled(terms, uncertain_floor)
    return JudgedBlocks(problem, modelled, *without_offsets(problem, modelled.residual, modelled.extra_power))


def cell_gains(data: Data, blocks: BlockSet, terms: Sequence[Term]) -> np.ndarray:
    """Nats (CELLS,) that effects with these values gain over none in each cell."""
    without = judged_blocks(data, blocks, (), uncertain_floor=bool(random_of(terms)))
    gains = judged_blocks(data, blocks, terms).log_likelihoods() - without.log_likelihoods()
    return np.bincount(without.problem.flat.cells, gains, CELLS)
