"""The diagnosis on flights made with other people's simulators, each alone: top-1, top-3, shrink.

    python tools/diagnosis/gap_peers.py [FLIGHTS/peers]

Each case is held against the two `cal` flights of its vehicle; the diagnosis never sees the label.
Names of one thing (`alike.ALIKE`) count as one.
"""

import argparse
import csv
import os
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
from airtouch import vehicle as vehicles
from airtouch.gap.diagnosis import diagnose
from airtouch.gap.sealed.intervals import wilson
from airtouch.gap.signatures.alike import interchangeable
from airtouch.logs import read

#: the manifest's name of an effect -> the registry's, where they differ
NAMES = {"latency": "sensor_latency", "act_delay": "actuator_delay", "thrust_coeff": "thrust_coefficient"}

GOAL = 0.8  #: fraction of the gap that the right effect should close (host/docs/gap-real.md)


def interval(hits: int, n: int) -> str:
    """A share with its 95 % interval, as text."""
    share = wilson(hits, n)
    return f"{hits} of {n} ({share['value']:.0%}, 95 % interval {share['low']:.0%} to {share['high']:.0%})"


def main(folder: Path) -> None:
    """Diagnose every labelled flight of the set and print a table with the counts of right answers."""
    rows = [r for r in csv.DictReader((folder / "manifest.csv").open()) if not r["file"].startswith("cal")]
    top_1 = top_3 = 0
    shrinks, controls = [], []
    print("| effect | strength | verdict | named | shrink | with a wrong effect | CPU s "
          "|\n|---|---|---|---|---|---|---|")
    for row in rows:
        v = row["vehicle"]
        began = time.process_time()
        answer = diagnose([read(folder / row["file"])], vehicles.load(folder / f"vehicle_{v.lower()}.toml"),
                          [read(folder / f"cal_{v}_{i}.csv.gz") for i in (0, 1)])
        true = NAMES.get(row["effect"], row["effect"])
        ranked = [r.name for r in answer.ranking[:3]]
        top_1 += interchangeable(ranked[0], true)
        top_3 += any(interchangeable(r, true) for r in ranked)
        effects = "; ".join(f"{e.name} " + ", ".join(f"{k} {q.value:.3g}" for k, q in e.parameters.items()
                                                     if q.low is not None) for e in answer.effects)
        control = None if answer.control is None else answer.control.shrink.share.value
        if answer.shrink is not None and interchangeable(ranked[0], true):
            shrinks.append(answer.shrink.value)
            controls += [control] if control is not None else []
        print(f"| {true} | {float(row['strength']):.3g} {row['unit'].split(',')[0][:24]} | {answer.verdict} | "
              f"{effects} | {'' if answer.shrink is None else f'{answer.shrink.value:.2f}'} | "
              f"{'' if control is None else f'{control:.2f}'} | {time.process_time() - began:.0f} |", flush=True)
    print(f"\ntop-1 {interval(top_1, len(rows))}; top-3 {interval(top_3, len(rows))}")
    if shrinks:
        print(f"shrink with the right effect: median {sorted(shrinks)[len(shrinks) // 2]:.2f}, "
              f">= {GOAL:.2f} in {sum(s >= GOAL for s in shrinks)} of {len(shrinks)}; with a wrong one at most "
              f"{max(controls):.2f}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", type=Path, help="with a manifest.csv (FLIGHTS/peers)",
                        default=Path(os.environ.get("AIRTOUCH_FLIGHTS", "../shared/flights")) / "peers")
    peers = parser.parse_args().folder
    if not (peers / "manifest.csv").is_file():
        parser.error(f"{peers} has no manifest.csv: give the folder of the peers' flights, or set AIRTOUCH_FLIGHTS")
    main(peers)
