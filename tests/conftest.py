"""What every test may ask for."""

import os
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy: tests run beside one another

import pytest
from hypothesis import settings

settings.register_profile("reproducible", derandomize=True, deadline=None)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "reproducible"))



@pytest.fixture(scope="session")
def flights() -> Path:
    """The folder of recorded flights; tests that need it skip where it is absent."""
    folder = Path(os.environ.get("AIRTOUCH_FLIGHTS", Path(__file__).parents[2] / "shared" / "flights"))
    if not folder.is_dir():
        pytest.skip(f"no recorded flights at {folder}; set AIRTOUCH_FLIGHTS")
    return folder
