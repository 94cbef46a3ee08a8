"""Options that several commands have, and the types of their values."""

import math
from collections.abc import Callable
from typing import Any

import click


class Finite(click.FloatRange):
    """A finite number, of a range if one is given; a plain range of click holds NaN."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        number = super().convert(value, param, ctx)
        if not math.isfinite(number):
            self.fail(f"{value} is not a finite number.", param, ctx)
        return number

    def _describe_range(self) -> str:
        """The range as a help page shows it, "" without bounds, for which click prints "x<=None"."""
        return "" if self.min is None and self.max is None else super()._describe_range()


SPEED_MPS = Finite(0, 100, min_open=True)  #: a commanded speed; no source: above any, in m/s


def seed_option(text: str) -> Callable:
    """The option --seed, 0 if left out: NumPy takes none below 0. text: what it is the seed of."""
    return click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help=text)


def speed_option(function: Callable) -> Callable:
    """The option --speed of commands that score or train on flights (`dataset.collect`, `dataset.with_flown_speed`)."""
    text = "Commanded speed of flights without one in their manifest; the log's if left out."
    return click.option("--speed", type=SPEED_MPS, metavar="M/S", help=text)(function)
