"""What an effect does to the features: a curve along its strength, and how far single flights lie off it.

Coordinates are those of `space`: nominal flights have the covariance 1 there. A class is learned from pairs of
simulated flights, the same seeds with and without the effect.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from airtouch.gap.relations.readout import Readout

KNOT = float(np.log(3.0))  #: between two knots of a curve, in the logarithm of the strength
LEAST_SHIFT = 0.5  #: shift along a class's own direction below which a flight says nothing of the curve
LEAST_SIZE = 5.0  #: of a shift, by which errors of the curve are weighed
CLEAR = 40.0  #: size of a shift from which the scatter about the curve stands over that of nominal flights
ODD = 4.0  #: times the usual distance from the curve: a flight that hit something
SIGNED = 0.1  #: share of flights with a negative strength from which a class has two signs
RANK = 16  #: directions of the scatter
#: times the largest eigenvalue that noise alone gives (Marchenko and Pastur 1967), from which a direction counts
CHANCE = 1.2


@dataclass(frozen=True)
class EffectClass:
    """name: of the kind of effect; effect: of the registry; shape: value of the parameter that shapes it, or None.

    knots (k,): logarithms of strengths; table (parts, k, Q): shift per unit of strength at the knots, one part for each
    parameter and one more, even in the sign, where there are two signs; axes (Q, r), variances (r,): directions, and
    variances along them, of a flight's distance from the curve, over the squared size of the shift. readout: what its
    strengths are in the effect's units, where that is known.
    """

    name: str
    effect: str
    shape: float | None
    parameters: int
    signed: bool
    knots: np.ndarray
    table: np.ndarray
    axes: np.ndarray
    variances: np.ndarray
    readout: Readout | None = None

    @property
    def of_one_parameter(self) -> bool:
        """Whether the effect has several parameters, each with a class of its own: its name is "effect parameter"."""
        return self.name != self.effect and self.name.startswith(f"{self.effect} ")

    @property
    def least(self) -> float:
        """The least strength that was flown."""
        return float(np.exp(self.knots[0]))

    @property
    def most(self) -> float:
        return float(np.exp(self.knots[-1]))

    def mean(self, strength: np.ndarray) -> np.ndarray:
        """Expected shift (n, Q) at strengths (n, parameters), in units of the class."""
        parts, hats = _parts(strength, self.signed), _hats(np.linalg.norm(strength, axis=1), self.knots)
        together = parts[:, :, None] * hats[:, None]
        return together.reshape(len(strength), -1) @ self.table.reshape(together[0].size, -1)

    @cached_property
    def grid(self) -> tuple[np.ndarray, np.ndarray]:
        """Strengths (n, 1) of a class with one parameter, six a knot, and the shifts there (n, Q)."""
        steps = 6 * (len(self.knots) - 1) + 1
        one = np.exp(np.linspace(self.knots[0], self.knots[-1], steps))
        strength = np.concatenate([one, -one] if self.signed else [one])[:, None]
        return strength, self.mean(strength)


def _parts(strength: np.ndarray, signed: bool) -> np.ndarray:
    """What multiplies each part of a curve (n, parts)."""
    return np.column_stack([strength, np.linalg.norm(strength, axis=1)]) if signed else strength


def _hats(size: np.ndarray, knots: np.ndarray) -> np.ndarray:
    """Weights (n, k) of the knots at strengths (n,): straight lines in the logarithm, constant outside."""
    x = np.clip(np.log(np.maximum(size, 1e-300)), knots[0], knots[-1])
    left = np.clip(np.searchsorted(knots, x) - 1, 0, len(knots) - 2)
    share = (x - knots[left]) / (knots[left + 1] - knots[left])
    out = np.zeros((len(x), len(knots)))
    place = np.arange(len(x))
    out[place, left], out[place, left + 1] = 1.0 - share, share
    return out


def learn_class(name: str, effect: str, shape: float | None, strength: np.ndarray, shift: np.ndarray, flown: np.ndarray,
            ) -> EffectClass:
    """A class from flights: scaled parameters (n, parameters), shifts from the same flights without the effect (n, Q),

    and the flights themselves less the nominal mean (n, Q).

    With one parameter the strength is the shift along the class's main direction: what else of a flight makes the
    effect stronger or weaker (a battery's charge, the phase of four rotors) counts as its strength.
    """
    signs = np.sign(strength[:, 0]) if strength.shape[1] == 1 else np.ones(len(strength))
    strength = strength / np.median(np.abs(strength[strength != 0.0]))
    if strength.shape[1] == 1:
        unit = shift / np.maximum(np.linalg.norm(shift, axis=1, keepdims=True), 3.0) * signs[:, None]
        way = np.linalg.svd(unit, full_matrices=False)[2][0]
        along = shift @ (way * np.sign((unit @ way).sum()))
        seen = np.abs(along) > LEAST_SHIFT
        strength, shift, flown = along[seen, None], shift[seen], flown[seen]
    for _ in range(2):
        made, good = _fitted(name, effect, shape, strength, shift, flown)
        strength, shift, flown = strength[good], shift[good], flown[good]
    return made


def _fitted(name: str, effect: str, shape: float | None, strength: np.ndarray, shift: np.ndarray, flown: np.ndarray,
            ) -> tuple[EffectClass, np.ndarray]:
    """The class of these flights, and which of them lie about its curve as most do, bool (n,)."""
    size = np.linalg.norm(strength, axis=1)
    signed = bool((strength < 0.0).mean() > SIGNED)
    low, high = np.log(np.quantile(size, [0.01, 1.0]))
    knots = np.linspace(low, high, max(int(np.ceil((high - low) / KNOT)), 1) + 1)
    parts = _parts(strength, signed)
    columns = (parts[:, :, None] * _hats(size, knots)[:, None]).reshape(len(size), -1)
    weight = 1.0 / np.maximum(np.linalg.norm(shift, axis=1), LEAST_SIZE)
    table = np.linalg.lstsq(columns * weight[:, None], shift * weight[:, None], rcond=1e-6)[0]
    expected = columns @ table
    moved = np.linalg.norm(expected, axis=1)
    off = np.linalg.norm(shift - expected, axis=1) / np.hypot(moved, LEAST_SIZE)
    good = off < ODD * np.median(off)
    axes, variances = _scatter(flown[good] - expected[good], moved[good], columns.shape[1])
    return EffectClass(name, effect, shape, strength.shape[1], signed, knots,
                       table.reshape(parts.shape[1], len(knots), -1), axes, variances), good


def _scatter(off: np.ndarray, moved: np.ndarray, fitted: int) -> tuple[np.ndarray, np.ndarray]:
    """Directions (Q, r) and variances (r,) by which flights lie off their curve (n, Q), over the size of their shifts

    (n,), beyond what nominal flights scatter. fitted: coefficients of each coordinate of the curve.
    """
    clear = moved >= min(float(np.median(moved)), CLEAR)
    relative = off[clear] / moved[clear, None]
    many = len(relative)
    noise = float(np.mean(moved[clear] ** -2.0))
    _, size, axes = np.linalg.svd(relative / np.sqrt(max(many - fitted * clear.mean(), 1.0)), full_matrices=False)
    stands = size ** 2 > CHANCE * noise * (1.0 + np.sqrt(off.shape[1] / many)) ** 2
    stands[RANK:] = False
    return axes[stands].T, size[stands] ** 2 - noise
