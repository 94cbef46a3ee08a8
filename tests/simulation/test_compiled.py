"""What is compiled is compiled once, and again when a source has changed, wherever Numba keeps it."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import airtouch
from airtouch.simulation import compiled

COUNTS = """
from airtouch.simulation import loop
print(sum(loop.fly.stats.cache_hits.values()), sum(loop.fly.stats.cache_misses.values()))
"""


def test_what_one_process_compiles_another_reads():
    compiled.compile_all()
    process = subprocess.run([sys.executable, "-c", COUNTS], capture_output=True, text=True, check=True)
    assert process.stdout.split() == ["1", "0"]


LENGTH = """
from airtouch.simulation.body.caller import length
print(length(3.0))
"""
CALLER = """
from airtouch.simulation.compiled import jit
from airtouch.simulation.sensors.called import scaled
@jit
def length(x):
    return scaled(x)
"""
CALLED = """
from airtouch.simulation.compiled import jit
@jit
def scaled(x):
    return {factor} * x
"""


@pytest.mark.parametrize("where", ["beside", "NUMBA_CACHE_DIR"])
def test_a_change_of_what_a_function_calls_is_flown(tmp_path, where):
    """Numba alone keeps the caller's machine code, whose own file has not changed."""
    package = tmp_path / "airtouch"
    for name in ("", "simulation", "simulation/body", "simulation/sensors"):
        (package / name).mkdir(exist_ok=True)
        (package / name / "__init__.py").touch()
    shutil.copy(Path(airtouch.__file__).parent / "simulation" / "compiled.py", package / "simulation")
    (package / "simulation" / "body" / "caller.py").write_text(CALLER)
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    if where != "beside":
        environment[where] = str(tmp_path / "cache")
    lengths = []
    for factor in ("2.0", "2.0", "5.00"):
        (package / "simulation" / "sensors" / "called.py").write_text(CALLED.format(factor=factor))
        lengths.append(subprocess.run([sys.executable, "-c", LENGTH], env=environment, cwd=tmp_path,
                                      capture_output=True, text=True, check=True).stdout.strip())
    assert lengths == ["6.0", "6.0", "15.0"]
    caches = tmp_path / "cache" if where != "beside" else package
    assert list(caches.rglob("caller.length*.nbi"))
