"""`make` in this checkout, without the settings of whoever runs the tests."""

import os
import subprocess
from pathlib import Path

ROOT = Path(__file__).parents[2]


def make(*arguments):
    environment = {k: v for k, v in os.environ.items() if k not in ("CRAZYFLIE_BASE", "PLATFORM", "VEHICLE", "CONFIG")}
    # In the folder, not with -C: `make -C` adds a last line of its own.
    return subprocess.run(["make", *map(str, arguments)], cwd=ROOT, capture_output=True, text=True, env=environment)
