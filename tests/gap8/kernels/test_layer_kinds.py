"""The kinds of int8 layers have the numbers in Python that the C header gives them."""

import re
from pathlib import Path

from airtouch.detector.best.operations import OPERATIONS
from airtouch.reference.networks.int8_network import CONV, DENSE, MAX_POOL

HEADER = Path(__file__).parents[3] / "gap8" / "kernels" / "layer_int8.h"


def test_kinds_are_those_of_the_header():
    kinds = {CONV, MAX_POOL, DENSE, *(operation.kind for operation in OPERATIONS.values())}
    numbers = {kind.name: kind.number for kind in kinds}
    blocks = {f"sparse_{kind.name}": kind.sparse_number for kind in kinds if kind.sparse_number is not None}
    header = {name.lower(): int(number) for name, number in re.findall(r"LAYER_(\w+) = (\d+),", HEADER.read_text())}
    assert len(numbers) == len(kinds) and numbers | blocks == header
