"""A term of a hypothesis: one effect with its parameters, scaled so that 0 is neutral and 1 a natural step."""

import itertools
from collections.abc import Hashable, Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from airtouch.gap.result import Quantity
from airtouch.gap.signatures.signature import MEAN, Signature, free_of, signature_of
from airtouch.simulation.effects import Active, Effect, Parameter
from airtouch.simulation.effects.effect import Gate

WITHIN_90 = 1.645  #: standard deviations of a normal variable on either side that hold 90 %
RANGE_STEP = 0.05  #: natural step, as a fraction of its range, of a parameter whose default is neutral; chosen


@dataclass(frozen=True)
class Term:
    """An effect as a hypothesis: values of every parameter, those that are free (k of them), and how it shows.

    shows_in: MEAN, SPECTRUM or CLOCK (`signature`); values: of every parameter, in its unit; companion: in the model
    because another effect implies it, not reported itself; gate: when it acts, none: always.
    """

    effect: Effect
    shows_in: str
    free: tuple[str, ...]
    values: Mapping[str, float] = field(default_factory=dict)
    companion: bool = False
    gate: Gate = ()

    @property
    def name(self) -> str:
        """Name of the effect in the registry."""
        return self.effect.name

    @property
    def signature(self) -> Signature:
        """What the diagnosis knows of the effect."""
        return signature_of(self.effect)

    @property
    def identity(self) -> tuple[str, float | None]:
        """Name of the effect, and of one of which several may act together which of them this is."""
        return self.name, self.values.get(self.signature.several_by)

    @property
    def slot(self) -> Hashable:
        """What tells a term from the others of a hypothesis: its effect (of which rotor), and whether a companion."""
        return self.identity, self.companion

    @property
    def key(self) -> Hashable:
        """Equal for terms that are equal."""
        return (self.name, self.shows_in, self.free, *sorted(self.values.items()), self.companion, self.gate)

    def active(self, x: np.ndarray | None = None) -> Active:
        """The effect at scaled parameters x (k,), clipped to its bounds; None: at the values of the term."""
        return Active(self.effect, dict(self.values) if x is None else self.at(x), self.gate)

    def at(self, x: np.ndarray) -> dict[str, float]:
        """Values of all parameters, in their units, at scaled parameters x (k,), clipped to their bounds."""
        values = dict(self.values)
        for name, amount in zip(self.free, x, strict=True):
            p = self._parameter(name)
            values[name] = float(min(max(neutral_of(p) + amount * unit(p), p.low), p.high))
        return values

    def fitted(self, x: np.ndarray) -> "Term":
        """The term with the values that scaled parameters x (k,) stand for."""
        return replace(self, values=self.at(x))

    def refined(self) -> "Term":
        """The term with those parameters free too that are fitted last."""
        later = tuple(p for p in self.signature.free_later if p not in self.free)
        return replace(self, free=self.free + later) if later else self

    def shaped(self) -> "list[Term]":
        """The term in each shape that all the data may choose among; none where its effect has no shapes."""
        shape = self.signature.shape
        if shape is None or self.shows_in != MEAN:
            return []
        return [replace(self, values={**self.values, shape.parameter: v}) for v in shape.values]

    @property
    def acts_when_neutral(self) -> bool:
        """Whether the effect changes anything while its free parameters are neutral (a shape that is not)."""
        return not all(p.neutral is not None or p.name in self.free for p in self.effect.parameters) \
            and self.effect.settings is not None

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest scaled values (k,) of the free parameters."""
        low, high = [], []
        for name in self.free:
            p = self._parameter(name)
            low.append((p.low - neutral_of(p)) / unit(p))
            high.append((p.high - neutral_of(p)) / unit(p))
        return np.array(low), np.array(high)

    def scaled(self, values: Mapping[str, float]) -> np.ndarray:
        """Scaled values (k,) of the free parameters, from values in their units."""
        return np.array([(values[n] - neutral_of(self._parameter(n))) / self.step(n) for n in self.free])

    def among_all(self, x: np.ndarray, other: float = 0.0) -> np.ndarray:
        """Values (k,) of the first k free parameters in their places among all that its effect may have free.

        other: the value of those that this variant leaves alone. A random part has its own alone.
        """
        names = free_of(self.effect)
        if not set(names) & set(self.free):
            return np.array(x[:len(self.free)])
        out = np.full(len(names), other)
        for name, value in zip(self.free, x, strict=False):
            if name in names:
                out[names.index(name)] = value
        return out

    def step(self, name: str) -> float:
        """The natural step of a parameter, in its unit."""
        return unit(self._parameter(name))

    def quantities(self, scaled: np.ndarray, covariance: np.ndarray | None = None) -> dict[str, Quantity]:
        """Every parameter with its unit, the free ones with their 90 % interval.

        scaled (k,), covariance (k, k): of the free parameters, in natural steps; None: they are exact.
        """
        values, out = self.at(scaled), {}
        for p in self.effect.parameters:
            if p.name not in self.free:
                out[p.name] = Quantity(values[p.name], unit=p.unit)
                continue
            i = self.free.index(p.name)
            half = 0.0 if covariance is None else WITHIN_90 * float(np.sqrt(max(covariance[i, i], 0.0))) * unit(p)
            out[p.name] = Quantity(values[p.name], max(values[p.name] - half, p.low),
                                   min(values[p.name] + half, p.high), p.unit)
        return out

    def _parameter(self, name: str) -> Parameter:
        """The parameter of a name."""
        return parameter_of(self.effect, name)


Terms = tuple[Term, ...]  #: a hypothesis: effects that act together, each with its random part and its companion


def mean_slices(terms: Iterable[Term]) -> list[tuple[Term, slice]]:
    """The mean effects among terms, each with the slice of the free parameters of all that is its own."""
    mean = [t for t in terms if t.shows_in == MEAN]
    ends = itertools.accumulate(len(t.free) for t in mean)
    return [(t, slice(end - len(t.free), end)) for t, end in zip(mean, ends, strict=True)]


def parameter_of(effect: Effect, name: str) -> Parameter:
    """The parameter of an effect with a name."""
    return next(p for p in effect.parameters if p.name == name)


def unit(p: Parameter) -> float:
    """The natural step of a parameter, in its unit: from neutral to default, else RANGE_STEP of its range."""
    step = abs(p.default - neutral_of(p))
    return step if step > 0.0 else RANGE_STEP * (p.high - p.low)


def neutral_of(p: Parameter) -> float:
    """The value of a parameter at which its effect does nothing; 0 where it has none."""
    return 0.0 if p.neutral is None else p.neutral
