"""Draws two pictures of the pages: one held-out flight through the `best` detector, and its reliability.

    airtouch crossval --detector best --json out/best.json
    python tools/pages/picture.py

The first command trains for two to four minutes a fold, the second takes seconds. It draws a flight of fold 0 with the
model that never saw it (host/docs/img/flight.png) and the reliability over all folds (reliability.png).
"""

import argparse
import json
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from airtouch import logs
from airtouch.cli.shared.flights import need_flights
from airtouch.detector import best
from airtouch.detector.best.batches import channels_of
from airtouch.detector.best.model import BestModel
from airtouch.detector.evaluation.data import dataset
from airtouch.detector.evaluation.score import FlightScore
from airtouch.detector.evaluation.score_report import reliability_of
from airtouch.errors import AirTouchError, in_one_line
from airtouch.logs.files import make_folder
from airtouch.logs.flight_log import FlightLog
from airtouch.reference.motion_channels import NAMES
from airtouch.report.evaluation_figures import reliability
from airtouch.report.style import BLUE, GREEN, GREY, RED, panes, style, write_image

CHANNELS = ("motor mean", "gyro x", "ax")  #: that are drawn
OFFSET = 5  #: nominal amplitudes between two channels
MARGIN_S = (6, 5)  #: s before the first edge and after the last


def main() -> None:
    """Draw both pictures and write them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--models", type=Path, default=Path("out/crossval"), help="where crossval kept its models")
    parser.add_argument("--flight", default="imu_data_0126-1916.csv.gz", help="a flight of fold 0")
    parser.add_argument("--json", type=Path, default=Path("out/best.json"), help="what crossval wrote")
    parser.add_argument("--out", type=Path, default=Path("host/docs/img"), help="folder")
    options = parser.parse_args()
    folder = need_flights()
    file = next((f for f in dataset.collect([folder]) if f.path.name == options.flight), None)
    if file is None:
        raise AirTouchError(f"{folder} has no {options.flight}: give another one with --flight")
    path = min(options.models.glob(f"best_fold{file.condition.fold}_*.npz"), default=None)
    if path is None or not options.json.is_file():
        raise AirTouchError(f"{options.models if path is None else options.json} is not there: airtouch crossval "
                            f"--out {options.models} --json {options.json}")
    make_folder(options.out)
    write_image(draw(logs.read(file.path), best.load(path), options.flight), options.out / "flight.png", force=True)
    scores = [FlightScore.from_dict(s) for s in json.loads(options.json.read_text())["per_flight"]]
    write_image(reliability({"best": reliability_of(scores)}), options.out / "reliability.png", force=True)
    print(f"written: flight.png and reliability.png in {options.out}")


def draw(log: FlightLog, model: BestModel, name: str) -> Figure:
    """What the drone measures, P(over a platform) with edges, and the down range that it never saw."""
    trace, truth = best.run(log, model), logs.true_edges(log)
    x = channels_of(log)[0]
    t = np.arange(len(log)) * 0.01
    first, last = t[truth[0].sample] - MARGIN_S[0], t[truth[-1].sample] + MARGIN_S[1]
    with style():
        figure, grid = panes((8.0, 4.6), 3, sharex=True, height_ratios=(1.3, 1, 0.7))
        axes = grid[:, 0]
        for i, channel in enumerate(CHANNELS):
            axes[0].plot(t, x[:, NAMES.index(channel)] + OFFSET * (len(CHANNELS) - 1 - i), lw=0.7, color=GREY)
        axes[0].set_yticks([OFFSET * (len(CHANNELS) - 1 - i) for i in range(len(CHANNELS))], CHANNELS)
        axes[0].set_title(f"{name}: what the drone measures, in units of its nominal amplitude", loc="left")
        axes[1].plot(t, trace.probability, color=BLUE, lw=1)
        axes[1].set(ylim=(-0.05, 1.25), yticks=(0, 1), ylabel="P(over)")
        lag = best.lag_s(model)
        for edge in trace.edges:
            at = edge.sample * 0.01 - lag
            axes[1].plot(at, 1.12, "v" if edge.kind == "entry" else "^", color=RED, ms=7)
        axes[1].set_title(f"detected edges (red; constant lag of {lag:.2f} s taken off) and true ones (dashed green)",
                          loc="left")
        axes[2].plot(t, log["zrange_m"], color=GREEN, lw=1)
        axes[2].set(xlabel="time, s", ylabel="m", xlim=(first, last))
        axes[2].set_title("down range: the truth, never an input", loc="left")
        for ax in axes:
            for crossed in truth:
                ax.axvline(crossed.sample * 0.01, color=GREEN, ls="--", lw=1)
    return figure


if __name__ == "__main__":
    with in_one_line("picture"):
        main()
