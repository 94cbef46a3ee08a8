"""Whether an answer has the rotor or the loop of a drawn effect right, and not its name alone."""

from collections.abc import Mapping
from typing import Any

from airtouch.gap.sealed.key import DrawnEffect
from airtouch.gap.signatures.random_draws import own_parameter
from airtouch.gap.signatures.signature import signature_of
from airtouch.simulation.effects import get


def has_variants(effect: DrawnEffect) -> bool:
    """Whether an effect is one of several of its name: of one rotor, or of one parameter."""
    return bool(signature_of(get(effect.name)).several_by or own_parameter(effect.name, effect.kind))


def same_variant(effect: DrawnEffect, parameters: Mapping[str, Mapping[str, Any]]) -> bool:
    """Whether parameters of a named effect, as JSON, are of the rotor that was drawn, and free that parameter alone."""
    by, own = signature_of(get(effect.name)).several_by, own_parameter(effect.name, effect.kind)
    free = [name for name, quantity in parameters.items() if "low" in quantity]
    return (not by or parameters.get(by, {}).get("value") == effect.values[by]) and (own is None or free == [own])
