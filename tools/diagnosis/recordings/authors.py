"""The authors' flights as the diagnosis is asked about them: three questions of host/docs/gap-findings.md."""

import csv
from pathlib import Path

CLOSE = 10  #: low flights diagnosed against high ones; no source: round number, for a minute of time


def questions(folder: Path) -> dict[str, tuple[list[str], list[str]]]:
    """For each question its flights and its baseline, clean flights of the manifest flown straight."""
    rows = [r for r in csv.DictReader((folder / "manifest.csv").open()) if r["use"] == "clean"]

    def straight(height: str, wind: str = "none", day: str = "") -> list[str]:
        """Files of the flights straight over the edges, of a height ("" for any), wind and part of a day's name."""
        return [str(folder / r["file"]) for r in rows if r["wind"] == wind and r["angle_deg"] == "0"
                and height in ("", r["height"]) and day in r["file"]]

    low = straight("low")
    return {"all": (low, []), "close": (low[:CLOSE], straight("h80")),
            "wind": (straight("low", "wind"), straight("", day="_0103-"))}
