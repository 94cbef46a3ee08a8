"""The emulator's tools, and what they need of this machine."""

import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))  # tools.emulator is no part of the installed package


@pytest.fixture(scope="session", autouse=True)
def emulator():
    """Tests here skip, with the remedy, where the emulator or a cross compiler is missing."""
    for package in ("unicorn", "ziglang"):
        pytest.importorskip(package, reason=f"pip install {package}")
