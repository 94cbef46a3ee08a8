"""The hover patterns of CrazyPAD's flights, and what the evidence of one says first."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from airtouch.cli.shared.progress import with_bar
from airtouch.gap.balance.hover_pattern import HoverPattern, hover_pattern
from airtouch.gap.flights.flight import ready
from airtouch.logs import read
from airtouch.vehicle import Vehicle


def hover_patterns(folder: Path, rows: list[dict[str, str]], vehicle: Vehicle) -> list[HoverPattern]:
    """The pattern of each flight of some rows of the manifest."""
    return [hover_pattern(ready(read(folder / r["file"]), vehicle), vehicle) for r in with_bar(rows, "flights")]


def likeliest(logs: np.ndarray, names: Sequence[str]) -> str:
    """The name whose hypotheses are likeliest together. logs: log evidence (n,); names: of each hypothesis."""
    chance: dict[str, float] = {}
    for name, p in zip(names, np.exp(logs - logs.max()), strict=True):
        chance[name] = chance.get(name, 0.0) + float(p)
    return max(chance, key=chance.__getitem__)
