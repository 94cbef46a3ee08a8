"""The cuts of neural-swarm's flights: which of them are of one flight, and how their clocks stand to each other.

Several vehicles fly at once, each with its own log; a cut is a part of one log. manifest.csv and baselines.csv hold a
row for each cut: `flight` is its log, "folder/cf50_01" for flight 01 of vehicle cf50, `start_s` and `stop_s` its ends
on the clock of the flight, which all vehicles share.
"""

import csv
from pathlib import Path

Row = dict[str, str]
TABLES = ("manifest.csv", "baselines.csv")  #: labelled cuts, and nominal ones to hold them against


def cuts(folder: Path) -> list[Row]:
    """Rows of all cuts in the data's folder, those with a label first."""
    return [row for name in TABLES for row in csv.DictReader((folder / name).open())]


def flight_of(row: Row) -> tuple[str, str]:
    """The flight of a cut: folder, and number within it."""
    folder, name = row["flight"].rsplit("/", 1)
    return folder, name.split("_")[1]


def partners(row: Row, other: Row) -> bool:
    """Whether two cuts are of two vehicles in one flight, at any time of it."""
    return flight_of(other) == flight_of(row) and other["cf"] != row["cf"]


def delay_s(row: Row, other: Row) -> float:
    """Seconds by which another cut of the same flight begins after this one."""
    return float(other["start_s"]) - float(row["start_s"])


def overlap(row: Row, other: Row) -> bool:
    """Whether two cuts of one flight have a time in common."""
    return float(other["start_s"]) < float(row["stop_s"]) and float(row["start_s"]) < float(other["stop_s"])
