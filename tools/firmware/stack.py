"""Prints the deepest stack of functions in a firmware build, from GCC's -fcallgraph-info=su files.

    python tools/firmware/stack.py build/firmware appMain    # 0.2 s for 30 sources

Sums frames along the deepest chain of calls. Calls through pointers are not seen; libraries and recursions are not
counted: their names are printed, add what they need. What follows a failed assertion is left out: the drone has
stopped by then. CONFIG_APP_STACKSIZE (firmware/app/app-config) counts words of four bytes.
host/docs/flash.md has the figures.
"""

import argparse
from pathlib import Path

from call_graph import deepest


def main() -> None:
    """Print the deepest chain of calls, and what is not counted in it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=Path, help="folder that `make firmware` built in")
    parser.add_argument("function", help="at which the chain begins")
    options = parser.parse_args()
    total, path, outside = deepest(options.build, options.function)
    print(f"{total} bytes: {' > '.join(path)}")
    print(f"not counted: {', '.join(sorted(outside))}")


if __name__ == "__main__":
    main()
