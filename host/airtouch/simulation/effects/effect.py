"""What an effect is: parameters with units and bounds, and how it enters the equations."""

import inspect
import warnings
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numba
import numpy as np
from numba import float64, types, uint64

from airtouch.errors import AirTouchError
from airtouch.simulation.compiled import jit

warnings.filterwarnings("ignore", "First-class function type feature is experimental")

PARAMETERS = 12  #: an effect's parameters in compiled code, at most
MEMORY = 12  #: numbers that an effect may keep from step to step
SIGNATURE = types.void(float64[::1], float64[::1], float64[::1], uint64[::1], float64[::1])
WrenchFunction = types.FunctionType(SIGNATURE)


def wrench(function: Callable) -> Any:
    """Compile `function(p, s, memory, generator, out)` so that simulator and diagnosis can call it.

    p: the effect's parameters in their declared order (PARAMETERS at most). s: signals, by the places in
    `simulation.signals`. memory (12,): zero at the start of a flight, its own from then
    on. generator: its random numbers, for `random_generator.normal`. out (6,): add force
    (N) and torque (N m) about the centre of mass, body axes. Called once a step.
    """
    if function.__module__.startswith("airtouch."):
        return jit([SIGNATURE])(function)
    return numba.njit([SIGNATURE])(function)  # may make arrays


@dataclass(frozen=True)
class Parameter:
    """A number that an effect takes. neutral: the value at which it changes nothing.

    None as neutral: it shapes the effect (a direction, a length, which rotor) and is not
    scaled with its strength. unit "1" is a pure number. source: paper, data sheet or measurement.
    """

    name: str
    unit: str
    default: float
    low: float
    high: float
    neutral: float | None
    summary: str
    source: str = ""
    integer: bool = False


@dataclass(frozen=True)
class Effect:
    """One unmodelled effect: it has `settings`, which change the plant before the flight, a `wrench`, or both.

    A wrench adds a force and a torque in flight (see `wrench`). settings(plant row, {parameter: value}) changes
    fields of `simulation.plant.FIELDS`.
    """

    name: str
    summary: str
    parameters: tuple[Parameter, ...]
    settings: Callable[[Any, Mapping[str, float]], None] | None = None
    wrench: Any = None
    presets: Mapping[str, Mapping[str, float]] = field(default_factory=dict)  #: values measured together
    once: bool = False  #: True: its settings replace values of the plant, so that a second one would undo the first

    def __post_init__(self) -> None:
        """Raise AirTouchError for a wrench that nobody compiled and for too many parameters."""
        if len(self.parameters) > PARAMETERS:
            raise AirTouchError(f"effect {self.name}: {len(self.parameters)} parameters; {PARAMETERS} at most")
        if inspect.isfunction(self.wrench):
            raise AirTouchError(f"effect {self.name}: put @wrench above the function {self.wrench.__name__}, "
                                "so that it is compiled")

    def values(self, overrides: Mapping[str, float | str] | None = None) -> dict[str, float]:
        """Every parameter: what is overridden, else what the preset says, else its default.

        overrides: {parameter: value}, and under "preset" the name of one of `presets`.
        Raises AirTouchError for an unknown name and for values out of bounds.
        """
        overrides = dict(overrides or {})
        preset = overrides.pop("preset", None)
        if preset is not None:
            if not isinstance(preset, str) or preset not in self.presets:
                listed = ", ".join(self.presets) or "it has none"
                raise AirTouchError(f"{self.name} has no preset {preset!r}; known: {listed}")
            overrides = {**self.presets[preset], **overrides}
        known = {p.name: p for p in self.parameters}
        for name in overrides:
            if name not in known:
                raise AirTouchError(f"{self.name} has no parameter {name!r}; it has {', '.join(known)}")
        result = {}
        for p in self.parameters:
            try:
                value = float(overrides.get(p.name, p.default))
            except (TypeError, ValueError, OverflowError):
                raise AirTouchError(f"{self.name}: {p.name} must be a number") from None
            if not p.low <= value <= p.high:
                raise AirTouchError(f"{self.name}: {p.name} = {value:g} {p.unit} is out of bounds, "
                                    f"{p.low:g} to {p.high:g} {p.unit}")
            if p.integer and value != round(value):
                raise AirTouchError(f"{self.name}: {p.name} must be a whole number, not {value:g}")
            result[p.name] = value
        return result

    def scaled(self, values: Mapping[str, float], strength: float) -> dict[str, float]:
        """`values` moved towards neutral: strength 1 leaves them, 0 makes them neutral.

        Those without a neutral value stay. One of them acts at strength 0 too: `behind` of time_jitter, where it is
        not the plant's own 0.004 s.
        """
        return {p.name: values[p.name] if p.neutral is None
                else p.neutral + strength * (values[p.name] - p.neutral) for p in self.parameters}

    def vector(self, values: Mapping[str, float]) -> np.ndarray:
        """The parameters (PARAMETERS,) as compiled code gets them."""
        out = np.zeros(PARAMETERS)
        out[:len(self.parameters)] = [values[p.name] for p in self.parameters]
        return out


Gate = tuple[tuple[str, float, float], ...]  #: when an effect acts: intervals (flight, from_s, to_s)


@dataclass(frozen=True)
class Active:
    """An effect that is switched on, with the values of all its parameters.

    gate: stretches outside which a replayed log does not feel it; none: it always acts.
    """

    effect: Effect
    values: Mapping[str, float]
    gate: Gate = ()

    @property
    def key(self) -> Hashable:
        """Equal for the same effect with the same values and gate."""
        return self.effect.name, *sorted(self.values.items()), self.gate
