"""The flights of `airtouch gap demo`, simulated by `python tools/simulation/gap_example.py`."""

import tomllib
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parent
ANSWER = "answer.toml"


def real() -> Path:
    """The flight whose effect is to be found."""
    return FOLDER / "real.csv.gz"


def nominal() -> list[Path]:
    """Four flights without it."""
    return sorted(FOLDER.glob("nominal_*.csv.gz"))


def answer() -> dict[str, Any]:
    """{effect: {parameter: value}} that was switched on in `real`."""
    return tomllib.loads((FOLDER / ANSWER).read_text(encoding="utf-8"))["effects"]
