"""Prints what the wakes in neural-swarm's flights under another vehicle show, by one of four tests.

    python tools/diagnosis/gap_wakes.py [FLIGHTS]                      # wakes that a test sees which knows the seconds
    python tools/diagnosis/gap_wakes.py [FLIGHTS] --false-alarms       # nominal flights diagnosed with such seconds
    python tools/diagnosis/gap_wakes.py [FLIGHTS] --without-seconds    # how well each measure of the diagnosis tells
    python tools/diagnosis/gap_wakes.py [FLIGHTS] --with-labels        # what classifiers detect that have the labels

The test that knows the seconds, [--part build|all] [--answers x.jsonl], takes 15 s. The seconds come from the other
vehicles' own logs, where the data hold a cut of the same time: another vehicle within 0.15 m sideways and 0.1 to 0.6 m
above, as the data's labels say. In these seconds against the rest of the flight: the mean force along z, the power of
that force above 1 Hz, and the power of the yaw torque from 2 to 20 Hz. The same three are taken of nominal flights of
the same vehicle and kind of flying, in the same seconds shifted along the flight by each half second. A flight is seen
where one of the three is beyond all but a third of one per cent of these, which makes 1 % false alarms. --answers: what
`gap_real.py --keep` wrote, to print what the diagnosis says beside it; the results of one run, as one with --partner
and one without would each say something else. build: days 19 and 20.

--false-alarms [--keep x.jsonl] takes 15 min. Each nominal flight of days 19 and 20 against the others of its group
(`gap_real.py --rows nominal`), as if another vehicle had been overhead in the seconds of each downwash flight of its
kind: how often a wake passes for one there.

--without-seconds takes 3 to 5 min. Of the wakes and the nominal flights of days 19 and 20: how well each measure by
which the diagnosis knows a wake tells the two apart. The figures are in host/docs/gap-real.md and gap-findings.md.

--with-labels, [--part build|all], takes 3 to 8 min. The same flights, or those of all days, described by these measures
and by how much stronger force and torque are in some half seconds than in others, in six bands. Two classifiers have
the labels of all other flights, or of all other drones and days; the diagnosis has none. The limit leaves 5 % of these
nominal flights beyond it.
"""

import argparse
import os
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from airtouch.cli.shared.flights import check_data_set
from airtouch.cli.shared.progress import with_bar
from airtouch.detector.evaluation.data.folds import BUILD_DAYS
from airtouch.errors import AirTouchError, in_one_line
from airtouch.logs.files import check_free
from recordings import swarm_cuts
from recordings.folder import add_folder
from recordings.result_store import add_keep_option
from recordings.wakes.false_alarms import show_false_alarms
from recordings.wakes.known_seconds import answers_of, show_detected
from recordings.wakes.tracks import track
from recordings.wakes.with_labels import show_with_labels
from recordings.wakes.without_seconds import show_without_seconds


def main() -> None:
    """Print how many wakes one of the four tests sees, or the false alarms of the diagnosis."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add_folder(parser, name="flights")
    parser.add_argument("--part", choices=("build", "all"), default="build",
                        help="days 19 and 20, or all days (default %(default)s)")
    parser.add_argument("--answers", type=Path, metavar="FILE", help="what `gap_real.py --keep` wrote")
    add_keep_option(parser, "of --false-alarms: ")
    instead = parser.add_mutually_exclusive_group()
    instead.add_argument("--false-alarms", action="store_true", help="what the diagnosis says of nominal flights")
    instead.add_argument("--without-seconds", action="store_true", help="what a test without the seconds detects")
    instead.add_argument("--with-labels", action="store_true", help="what classifiers with the labels detect")
    options = parser.parse_args()
    other_test = options.false_alarms or options.without_seconds or options.with_labels
    if other_test and options.answers:
        parser.error("--answers is of the test that knows the seconds: leave it out")
    if options.part == "all" and (options.false_alarms or options.without_seconds):
        parser.error("--part all is of the test that knows the seconds and of --with-labels: leave it out")
    if options.keep and not options.false_alarms:
        parser.error("--keep is of --false-alarms: add it, or leave out --keep")
    check_data_set(options.flights / "neuralswarm", "baselines.csv")
    check_free(options.keep, force=True)
    if options.answers is not None and not options.answers.is_file():
        raise AirTouchError(f"{options.answers}: no such file; gap_real.py --keep writes one")
    answer_of = answers_of(options.answers)
    if options.answers and not answer_of:
        raise AirTouchError(f"{options.answers} has no flight of neural-swarm: gap_real.py --rows swarm --keep writes "
                            "them")
    if options.without_seconds:
        show_without_seconds(options.flights)
        return
    if options.with_labels:
        show_with_labels(options.flights, options.part)
        return
    folder = options.flights / "neuralswarm"
    rows = [r for r in swarm_cuts.cuts(folder) if options.part == "all" or r["day"] in BUILD_DAYS]
    tracks = [track(folder, r) for r in with_bar([r for r in rows if r.get("truth") != "ground_effect"], "tracks")]
    if options.false_alarms:
        show_false_alarms(options.flights, tracks, options.keep)
    else:
        show_detected(tracks, answer_of)


if __name__ == "__main__":
    with in_one_line("gap_wakes"):
        main()
