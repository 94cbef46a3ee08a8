"""The map of the diagnosis' modules names every one of them, and no other."""

import re
from pathlib import Path

from airtouch import gap


def test_every_module_is_on_the_map():
    there = {path.stem for path in Path(gap.__file__).parent.glob("*.py")} - {"__init__"}
    listed = gap.__doc__.partition("Where each decision is made:")[2]
    assert set(re.findall(r"`(\w+)`", listed)) == there
