"""The kinds of int8 layers have the numbers in Python that the C header gives them."""

import re
from pathlib import Path

from airtouch.reference.networks.int8_network import KINDS, OPERATIONS

HEADER = Path(__file__).parents[2] / "gap8" / "kernels" / "layer_int8.h"


def test_kinds_are_those_of_the_header():
    numbers = re.findall(r"LAYER_(\w+) = (\d+),", HEADER.read_text())
    assert {name.lower(): int(number) for name, number in numbers} == {kind: i for i, kind in enumerate(KINDS)}
    assert set(OPERATIONS) == {kind for kind in KINDS if not kind.startswith("sparse_")}
