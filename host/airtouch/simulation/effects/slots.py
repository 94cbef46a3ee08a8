"""The effects of one flight as compiled code takes them: a fixed number of slots, each with a wrench."""

import functools
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numba import float64, int64, types, uint64
from numba.core.typing.typeof import typeof_impl
from numba.experimental.function_type import _get_wrapper_address

from airtouch.errors import AirTouchError
from airtouch.simulation.compiled import inlined
from airtouch.simulation.effects.effect import PARAMETERS, SIGNATURE, Active, WrenchFunction, wrench

SLOTS = 16  #: effects with a wrench that may be on at once


class EffectSlots(NamedTuple):
    """Wrenches with their parameters and random numbers; `used` of the SLOTS act.

    wrenches: compiled functions; parameters (SLOTS, PARAMETERS); generators (SLOTS, 1): random numbers of each.
    """

    wrenches: tuple
    used: int
    parameters: np.ndarray
    generators: np.ndarray


EFFECT_SLOTS = types.NamedTuple(
    (types.UniTuple(WrenchFunction, SLOTS), int64, float64[:, ::1], uint64[:, ::1]), EffectSlots)


class _Address:
    """A compiled function by its address: numba else looks each one up by name at every call."""

    _numba_type_ = WrenchFunction

    def __init__(self, function: Any) -> None:
        self.function = function  # whose machine code must stay
        self.address = _get_wrapper_address(function, SIGNATURE)

    def __wrapper_address__(self) -> int:
        return self.address


@functools.cache
def _address(function: Any) -> _Address:
    return _Address(function)


@wrench
def _nothing(p, s, memory, generator, out):
    pass


@typeof_impl.register(EffectSlots)
def _type_of_slots(value: EffectSlots, _context: Any) -> types.NamedTuple:
    """Known beforehand, so that numba need not work it out at each call."""
    return EFFECT_SLOTS


def slots(active: Sequence[Active], generators: Sequence[np.ndarray]) -> EffectSlots:
    """Slots of effects that have a wrench, each with its generator (1,) of random numbers.

    Raises AirTouchError for more effects than slots.
    """
    if len(active) > SLOTS:
        raise AirTouchError(f"{len(active)} effects with a force at once; at most {SLOTS}")
    wrenches = [a.effect.wrench for a in active] + [_nothing] * (SLOTS - len(active))
    parameters, numbers = np.zeros((SLOTS, PARAMETERS)), np.zeros((SLOTS, 1), np.uint64)
    for i, (a, generator) in enumerate(zip(active, generators, strict=True)):
        parameters[i], numbers[i] = a.effect.vector(a.values), generator
    return EffectSlots(tuple(map(_address, wrenches)), len(active), parameters, numbers)


@inlined
def add(effects, s, memory, force):
    """Add force and torque of every effect to force (6,), N and N m in body axes.

    effects: EffectSlots; s (COUNT,): signals; memory (SLOTS, MEMORY): what the effects keep.
    """
    for i in range(effects.used):
        effects.wrenches[i](effects.parameters[i], s, memory[i], effects.generators[i], force)
