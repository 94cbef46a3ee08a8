"""The folder of recorded flights on the command line of a script."""

import argparse
from pathlib import Path

from airtouch.cli.shared.flights import data_folder


def add_folder(parser: argparse.ArgumentParser, data_set: str = "", name: str = "folder") -> None:
    """Add a positional argument `name`: the folder of a data set, or of all of them."""
    parser.add_argument(name, nargs="?", type=Path, default=data_folder(data_set),
                        help=f"folder of the data set{'' if data_set else 's'} (default: "
                             f"{data_set}{' in ' * bool(data_set)}AIRTOUCH_FLIGHTS or ../shared/flights)")
