"""What each kernel may cost on each core: budget.toml, and what of it is exceeded."""

import tomllib
from dataclasses import fields
from pathlib import Path

from .flight_code import Cost

PATH = Path(__file__).with_name("budget.toml")  #: file of the limits


def load(core: str, path: Path = PATH) -> dict[str, Cost]:
    """Kernel -> what it may cost at most."""
    with open(path, "rb") as file:
        table = tomllib.load(file)
    return {kernel: Cost(**limits) for kernel, limits in table[core].items()}


def excess(name: str, cost: Cost, limit: Cost) -> list[str]:
    """A sentence for each number over its limit."""
    pairs = [(f.name, getattr(cost, f.name), getattr(limit, f.name)) for f in fields(Cost)]
    return [f"{name}: {what} is {is_:,.0f}, the budget {may:,.0f}" for what, is_, may in pairs if is_ > may]
