"""Slopes of the spectra by the parameters of mean effects, for the steps of a fit."""

from collections.abc import Sequence

import numpy as np

from airtouch.gap.evidence.problem import Problem
from airtouch.gap.evidence.torque_power import loops_differ
from airtouch.gap.signatures.term import Term, mean_places
from airtouch.simulation.effects import Active

STEP = 0.02  #: change of a scaled parameter over which slopes are taken; chosen
FAR = 0.3  #: change of a scaled parameter, of its size or of 1, over which slopes are taken anew; chosen


def active_at(mean: Sequence[Term], x: np.ndarray) -> list[Active]:
    """Mean effects at scaled parameters x (k,), without those that are neutral there."""
    return [t.active(x[place]) for t, place in mean_places(mean) if x[place].any() or t.acts_when_neutral]


class SpectraSlopes:
    """First-order changes of the spectra by k parameters of mean effects, taken anew only where a fit has moved far.

    at (k,): scaled parameters at which they were taken. For each parameter columns (n,): of the flattened spectra;
    rises (bins, axes): of the logarithm of the commands' power; torque_powers (replay,): of the floor of the torque;
    nonlinear: whether it changes the loop, so that the spectra are no linear function of it and its slopes are taken
    anew at every step. high (k,): largest parameters.
    """

    def __init__(self, problem: Problem, mean: Sequence[Term], high: np.ndarray) -> None:
        self.problem, self.mean, self.high = problem, mean, high
        size = sum(len(t.free) for t in mean)
        self.at = np.full(size, np.inf)
        self.columns = [np.zeros(0)] * size
        self.rises, self.torque_powers = [np.zeros(0)] * size, [np.zeros(0)] * size
        self.nonlinear = np.ones(size, bool)

    def take(self, x: np.ndarray, anew: bool = False) -> None:
        """Take slopes at scaled parameters x (k,): the nonlinear ones; all where x is far from the last, or if anew."""
        anew = anew or bool((np.abs(x - self.at) > FAR * np.maximum(np.abs(x), 1.0)).any())
        stale = np.arange(len(x)) if anew else np.flatnonzero(self.nonlinear)
        if not len(stale):
            return
        before = active_at(self.mean, x)
        values, power = self.problem.values(before), self.problem.torque_power(before)
        for i in stale:
            step = STEP if x[i] + STEP <= self.high[i] else -STEP
            shifted = x.copy()
            shifted[i] += step
            after = active_at(self.mean, shifted)
            self.columns[i] = (self.problem.values(after) - values) / step
            self.rises[i] = self.problem.flat.commands.rise(before, after) / step
            self.torque_powers[i] = (self.problem.torque_power(after) - power) / step
            self.nonlinear[i] = loops_differ(self.problem.data, before, after)
        self.at = x.copy() if anew else self.at

    def power_equations(self, x: np.ndarray, values: np.ndarray, added: np.ndarray | float, uncertain_floor: bool,
                        ) -> tuple[np.ndarray, np.ndarray]:
        """Gradient (k,) and information (k, k) of the likelihood by what parameters x (k,) do to the expected power.

        values, added: the gap, and the power over the floor, flattened; uncertain_floor: as in `Problem.modelled`.
        """
        problem = self.problem
        active, rises = active_at(self.mean, x), np.array(self.rises)
        gradient, information = problem.flat.commands.slopes(active, rises, uncertain_floor)
        powers = np.array(self.torque_powers)
        if powers.any():
            slope, curvature = problem.likelihood.power_slopes(values, np.broadcast_to(added, values.shape),
                                                           problem.flat.replay_count)
            gradient = gradient + powers @ slope
            information = information + (powers * curvature) @ powers.T
        return gradient, information
