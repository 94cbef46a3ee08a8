"""Makes labelled flights with RotorPy's Crazyflie and a control loop that is not the firmware's.

    python tools/simulation/rotorpy_flights.py OUT [--each 3] [--nominal 12] [--seed 0]    # 10 s of one core a flight
    python tools/diagnosis/gap_peers.py OUT

Each flight takes off, hovers, passes over a platform, hovers and lands, with one effect or none; its motors run on for
a second or two while it stands. Body and the laws of motor lag and drag are RotorPy's, the rest is added
(tools/simulation/rotorpy_loop). OUT gets a vehicle file, two flights to calibrate on, the flights and a manifest.csv of
the effect in each. Flights that are there already are kept, so that a stopped run goes on; a set of other options needs
another OUT. A flight in which the vehicle falls is left out of the manifest, with an error at the end. Needs the extra
`bench`. host/docs/gap-real.md has the figures.

    python tools/simulation/rotorpy_flights.py OUT --others --each 4 --nominal 10 --seed 6

--others: flights with five effects that FLIGHTS/peers lacks.
"""

import argparse
import csv
import io
import math
import multiprocessing
import os
from functools import partial
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
from airtouch.cli.shared.arguments import whole_number
from airtouch.cli.shared.progress import Bar
from airtouch.errors import AirTouchError, in_one_line
from airtouch.logs import write
from airtouch.logs.files import make_folder, write_bytes
from rotorpy_loop.labels import OTHERS, STRENGTHS, Label, labels_of

MANIFEST = "manifest.csv"


def main() -> None:
    """Make the flights, then the manifest."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path, metavar="OUT", help="folder, made if not there")
    parser.add_argument("--each", type=whole_number(0), default=3, help="flights an effect (default %(default)s)")
    parser.add_argument("--nominal", type=whole_number(0), default=12, help="without an effect (default %(default)s)")
    parser.add_argument("--seed", type=whole_number(0), default=0, help="of all that is drawn (default %(default)s)")
    parser.add_argument("--slow-error", type=factor, default=1.0, metavar="FACTOR",
                        help="on the slow error of position and velocity, 4 mm and 2 cm/s rms (default %(default)s)")
    parser.add_argument("--others", action="store_true", help="effects that FLIGHTS/peers lacks, not those there")
    options = parser.parse_args()
    labels = labels_of(options.each, options.nominal, options.seed, OTHERS if options.others else STRENGTHS)
    text = manifest(labels, options.slow_error)
    check(options.out, text)
    make_folder(options.out)
    write_bytes(text, options.out / MANIFEST, force=True)
    from rotorpy_loop import vehicle

    write_bytes(vehicle.FILE.encode(), options.out / "vehicle_a.toml", force=True)
    fly_one = partial(make, options.out, options.slow_error)
    with multiprocessing.Pool() as pool, Bar("flying") as bar:  # ends its workers at once when it is stopped
        reasons = []
        for reason in pool.imap(fly_one, labels):
            reasons.append(reason)
            bar(len(reasons), len(labels))
    failed = [reason for reason in reasons if reason]
    if failed:
        flown = [x for x in labels if (options.out / x.file).exists()]
        write_bytes(manifest(flown, options.slow_error), options.out / MANIFEST, force=True)
        raise AirTouchError(f"{len(failed)} of {len(labels)} flights failed and are not in {MANIFEST}: {failed[0]}")


def factor(text: str) -> float:
    """A finite number from 0 on, for argparse. Raises ArgumentTypeError for any other text."""
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not 0.0 <= number < math.inf:
        raise argparse.ArgumentTypeError(f"{text} is no number from 0 on")
    return number


def check(out: Path, text: bytes) -> None:
    """Raise AirTouchError where RotorPy is not installed, or OUT has flights that are not in a manifest's text."""
    try:
        import rotorpy  # noqa: F401
    except ModuleNotFoundError:
        raise AirTouchError("RotorPy is not installed: pip install rotorpy==3.0.0, or `make setup`") from None
    if (out / MANIFEST).exists() and not set((out / MANIFEST).read_bytes().splitlines()) <= set(text.splitlines()):
        raise AirTouchError(f"{out / MANIFEST}: flights of other options are there; choose another folder")


def manifest(labels: list[Label], slow_error: float) -> bytes:
    """The text of a manifest: a row for each flight."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(("file", "vehicle", "effect", "strength", "unit", "seed", "slow_error"))
    table.writerows((x.file, "A", x.effect, f"{x.strength:.5g}", x.unit, x.seed, f"{slow_error:g}") for x in labels)
    return text.getvalue().encode()


def make(out: Path, slow_error: float, label: Label) -> str:
    """Make one flight where it is not there yet; what went wrong, or ""."""
    from rotorpy_loop.flight import fly

    try:
        if not (out / label.file).exists():
            write(fly(label, slow_error), out / label.file)
    except AirTouchError as error:
        return str(error)
    return ""


if __name__ == "__main__":
    with in_one_line("rotorpy_flights"):
        main()
