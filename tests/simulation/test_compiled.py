"""What is compiled is compiled once: Numba keeps it beside the sources."""

import subprocess
import sys

from airtouch.simulation import compiled

COUNTS = """
from airtouch.simulation import loop
print(sum(loop.fly.stats.cache_hits.values()), sum(loop.fly.stats.cache_misses.values()))
"""


def test_what_one_process_compiles_another_reads():
    compiled.compile_all()
    process = subprocess.run([sys.executable, "-c", COUNTS], capture_output=True, text=True, check=True)
    assert process.stdout.split() == ["1", "0"]
