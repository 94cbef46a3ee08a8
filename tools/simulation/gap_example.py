"""Makes the flights of `airtouch gap demo`: four nominal ones, and one with an effect that its file does not name.

    python tools/simulation/gap_example.py [FOLDER]    # 3 s; the package's own example by default
"""

import argparse
from pathlib import Path

import tomli_w

from airtouch import logs
from airtouch.errors import AirTouchError, in_one_line
from airtouch.gap import example
from airtouch.logs.files import make_folder, write_bytes
from airtouch.simulation import batch

#: scenario of the example, seeds of its nominal flights and of the flight with the effect
SCENARIO, NOMINAL_SEED, REAL_SEED = "diagnosis", 41, 42
#: the withheld effect
EFFECT = {"weak_motor": {"rotor": 2, "thrust_loss": 0.12}}
DROPPED = ("rpm_", "range_", "acc_world")  #: columns that the diagnosis can do without


def main() -> None:
    """Write the flights and the answer."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", type=Path, default=example.FOLDER, help="of the package's example")
    folder = parser.parse_args().folder
    make_folder(folder)
    nominal = batch.flights(SCENARIO, 4, seed=NOMINAL_SEED, workers=1)
    real = batch.flights(SCENARIO, 1, effects=list(EFFECT.items()), seed=REAL_SEED, workers=1)
    for name, log in [*((f"nominal_{i}", log) for i, log in enumerate(nominal)), *(("real", log) for log in real)]:
        if not isinstance(log, logs.FlightLog):
            raise AirTouchError(f"{name}: {log}")
        columns = {k: v for k, v in log.columns.items() if not k.startswith(DROPPED)}
        about = {"vehicle": log.meta["vehicle"], "acc_frame": log.meta["acc_frame"],
                 "made_by": "python tools/simulation/gap_example.py"}
        logs.write(logs.FlightLog(columns, {**about, "source": name}), folder / f"{name}.csv.gz", force=True)
    answer = {"effects": EFFECT, "made_by": "python tools/simulation/gap_example.py"}
    write_bytes(tomli_w.dumps(answer).encode(), folder / example.ANSWER, force=True)
    print(f"written: five flights and {example.ANSWER} in {folder}")


if __name__ == "__main__":
    with in_one_line("gap_example"):
        main()
