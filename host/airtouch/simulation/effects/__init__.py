"""Every effect that can be switched on: one file each, one registry.

`EFFECTS` maps names to effects in the order in which they are applied. `register` adds
one of your own; `load_file` registers those of a Python file.
"""

from airtouch.simulation.effects.effect import Active, Effect, Parameter, wrench
from airtouch.simulation.effects.option import parse
from airtouch.simulation.effects.own_file import load_file, load_text, source_of
from airtouch.simulation.effects.registry import (
    EFFECTS,
    FOLDER_OF,
    NAMES,
    activate,
    get,
    names_of,
    register,
    unregister,
)

__all__ = ["EFFECTS", "FOLDER_OF", "NAMES", "Active", "Effect", "Parameter", "activate", "get", "load_file",
           "load_text", "names_of", "parse", "register", "source_of", "unregister", "wrench"]
