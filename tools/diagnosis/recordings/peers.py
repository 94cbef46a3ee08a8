"""Flights of other people's simulators: a manifest names the effect in each; two more of each vehicle have none."""

import csv
from pathlib import Path

Row = dict[str, str]  #: of the manifest: file, vehicle, effect, strength, unit
#: the manifest's name of an effect -> the registry's, where they differ
NAMES = {"latency": "sensor_latency", "act_delay": "actuator_delay", "thrust_coeff": "thrust_coefficient"}


def labelled(folder: Path) -> list[Row]:
    """Rows of the flights with an effect."""
    return [r for r in csv.DictReader((folder / "manifest.csv").open()) if not r["file"].startswith("cal")]


def truth(row: Row) -> str:
    """The registry's name of the effect in a flight."""
    return NAMES.get(row["effect"], row["effect"])


def vehicle_file(folder: Path, row: Row) -> Path:
    """The file of a flight's vehicle."""
    return folder / f"vehicle_{row['vehicle'].lower()}.toml"


def baseline(folder: Path, row: Row) -> list[Path]:
    """The two flights without an effect of a flight's vehicle."""
    return [folder / f"cal_{row['vehicle']}_{i}.csv.gz" for i in (0, 1)]
