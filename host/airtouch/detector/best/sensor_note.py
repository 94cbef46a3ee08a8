"""What `best` loses where a log lacks a sensor, in one line; with measured figures of the shipped model."""

import json
from collections.abc import Sequence
from functools import cache
from importlib import resources
from typing import Any

FILE = "best_sensors.json"  #: beside the models, written by tools/detectors/sensor_figures.py


@cache
def figures() -> dict[str, dict[str, Any]]:
    """Figures on unseen flights with all sensors ("all") and without each of `sensors.SENSORS`.

    Keys of each: of (which flights), edges, missed (share), false_per_minute, mean_abs_error_s.
    """
    return json.loads((resources.files("airtouch") / "models" / FILE).read_text(encoding="utf-8"))


def note(missing: Sequence[str], shipped: bool, columns: Sequence[str] = ()) -> str:
    """One line on what is lost without these sensors; "" if none is missing. Only the shipped model was measured.

    columns: those that are missing of a sensor that is logged in part.
    """
    if not missing:
        return ""
    lack = f"{missing[0]} without {', '.join(columns)} in this log" if columns else f"no {missing[0]} in this log"
    if not shipped:
        return lack
    return f"{lack}: {_text(figures()[missing[0]])}; with all sensors {_text(figures()['all'])}"


def _text(entry: dict[str, Any]) -> str:
    return (f"{entry['missed']:.1%} missed of {entry['edges']} unseen edges ({entry['of']}), "
            f"{entry['false_per_minute']:.2f} false a minute, mean error {entry['mean_abs_error_s']:.2f} s")
