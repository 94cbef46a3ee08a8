"""The folder of recorded flights on the command line of a script."""

import argparse
import os
from pathlib import Path

FLIGHTS = Path(os.environ.get("AIRTOUCH_FLIGHTS", "../shared/flights"))  #: a folder for each data set


def add_folder(parser: argparse.ArgumentParser, data_set: str = "", name: str = "folder") -> None:
    """Add a positional argument `name`: the folder of a data set, or of all of them."""
    parser.add_argument(name, nargs="?", type=Path, default=FLIGHTS / data_set,
                        help=f"of {data_set or 'the data sets'} (default: AIRTOUCH_FLIGHTS or ../shared/flights"
                             f"{', with ' * bool(data_set)}{data_set})")


def check_folder(parser: argparse.ArgumentParser, folder: Path) -> None:
    """End with a usage error where a data set's folder has no manifest.csv, before anything long begins."""
    if not (folder / "manifest.csv").is_file():
        parser.error(f"{folder} has no manifest.csv: give the folder of the flights, or set AIRTOUCH_FLIGHTS")
