"""Writes what `best` loses where a log lacks a sensor to `host/airtouch/models/best_sensors.json`, for its notes.

    AIR="--free-air ../shared/flights/neuralswarm/flights --free-air ../shared/flights/crazypad"
    airtouch crossval $AIR --free-air ../shared/flights/imrclab --out out/folds
    python tools/detectors/choose_decoder.py out/folds --json out/all.json
    python tools/detectors/choose_decoder.py out/folds --silence motors --json out/motors.json      # and rates
    airtouch evaluate ../shared/flights/airtouch-november --speed 0.3 --json out/november.json
    python tools/detectors/sensor_figures.py all=out/all.json=folds motors=out/motors.json=folds \\
        rates=out/rates.json=folds acceleration=out/november.json="another month"

The last command only reads files, in a second. The models in `out/folds` also serve logs without a sensor: the recipe
silences each one in a fraction of the crops. The shipped figures are of models of 2026-11-22 (host/docs/looks.md); the
commands are those of today. All figures are of flights that neither the weights nor the decoder's settings have seen;
the text after the second = says which.
"""

import argparse
import json
from pathlib import Path

from airtouch.detector.shared import sensors
from airtouch.errors import AirTouchError, in_one_line
from airtouch.logs.files import write_bytes

FILE = Path(__file__).parents[2] / "host" / "airtouch" / "models" / "best_sensors.json"  #: where the figures go
#: figures that the notes use, by their names in a score's JSON
FIGURES = ("edges", "missed", "false_per_minute", "mean_abs_error_s")


def figures(path: Path, where: str) -> dict[str, float | str]:
    """The figures that the notes use. Raises AirTouchError for another file, and for flights that the model knew."""
    try:
        table = json.loads(path.read_text())
        known = table.get("in_training")
        figures_of_sensor = {"of": where, **{name: round(table[name], 4) for name in FIGURES}}
    except (OSError, ValueError, AttributeError, KeyError, TypeError) as error:
        raise AirTouchError(f"{path}: not the JSON of tools/detectors/choose_decoder.py or `airtouch evaluate`: "
                            f"{error}") from None
    if known:
        raise AirTouchError(f"{path}: the model was trained on these flights; score others")
    return figures_of_sensor


def main() -> None:
    """Read, check, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pairs", nargs="+", metavar="NAME=JSON=WHERE",
                        help="all, and each sensor that may be missing")
    parser.add_argument("--out", type=Path, default=FILE, help="(default: the package's own)")
    options = parser.parse_args()
    if odd := [pair for pair in options.pairs if pair.count("=") != 2]:
        parser.error(f"{odd[0]} is not NAME=JSON=WHERE")
    content = {name: figures(Path(path), where) for name, path, where in (pair.split("=") for pair in options.pairs)}
    if set(content) != {"all", *sensors.SENSORS}:
        raise AirTouchError(f"figures of {', '.join(content)}; needed: all, {', '.join(sensors.SENSORS)}")
    write_bytes((json.dumps(content, indent=1) + "\n").encode(), options.out, force=True)
    print(f"written: {options.out}")


if __name__ == "__main__":
    with in_one_line("sensor_figures"):
        main()
