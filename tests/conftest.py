"""What every test may ask for."""

import gc
import importlib
import os
import sys

import pytest
from hypothesis import settings

import skips

# What Python compiles is kept, whatever the caller's setting: else each of two workers and some forty programs that the
# tests start would compile the package anew, the workers the tests as well.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False
os.environ["AIRTOUCH_CACHE"] = ""  # what tests measure is measured, not kept from an earlier run
for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "TF_NUM_INTRAOP_THREADS", "TF_NUM_INTEROP_THREADS"):
    os.environ.setdefault(_name, "1")  # before NumPy: tests run beside one another, and threads that wait spin
# What trains a network compiles it first: without optimisation that takes two thirds of the time, and as many steps of
# training hardly more.
os.environ.setdefault("XLA_FLAGS", "--xla_backend_optimization_level=0")

#: files that take longest, in this order: begun first, so that no worker is left with one of them at the end
LONGEST = ("test_adapt.py", "test_gap_real.py", "test_blind.py", "test_ablate.py", "test_user_effect.py",
           "test_rv32imc_networks.py", "test_gates.py", "test_random_effects.py", "test_notebooks.py", "test_fit.py",
           "test_train_and_export.py", "test_calibrate.py", "test_overhead.py", "test_labelled_flights.py",
           "test_demo.py", "test_fuzz.py", "test_team.py")

pytest_make_collect_report = skips.pytest_make_collect_report
pytest_runtest_makereport = skips.pytest_runtest_makereport

settings.register_profile("reproducible", derandomize=True, deadline=None)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "reproducible"))


def pytest_configure(config):
    """The simulator is compiled once, before several workers would each do so."""
    if getattr(config.option, "numprocesses", None) and not hasattr(config, "workerinput"):
        importlib.import_module("airtouch.simulation.compiled").compile_all()


def pytest_collection_modifyitems(items):
    """The longest files first; needs `--no-loadscope-reorder`, as xdist has an order of its own."""
    items.sort(key=lambda item: LONGEST.index(item.path.name) if item.path.name in LONGEST else len(LONGEST))


def pytest_collection_finish():
    """What is imported and collected by now stays: the garbage collector need not walk through it again and again."""
    gc.freeze()
    gc.set_threshold(10_000, 20, 20)


@pytest.fixture(scope="session", autouse=True)
def one_core():
    """Beside another worker of pytest a diagnosis does not fork: what both processes work out alike is work twice."""
    with pytest.MonkeyPatch.context() as patch:
        if "PYTEST_XDIST_WORKER" in os.environ:
            patch.setattr("airtouch.gap.second_process.spare_core", lambda: False)
        yield


@pytest.fixture(scope="session")
def flights():
    """The folder of recorded flights; tests that need it skip where it is absent."""
    folder = skips.folder()
    if not folder.is_dir():
        pytest.skip(f"no recorded flights at {folder}; set AIRTOUCH_FLIGHTS")
    return folder
