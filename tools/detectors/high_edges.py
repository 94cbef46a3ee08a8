"""Prints by which channels `best` detects high platforms, and how simulated edges differ from recorded ones.

    python tools/detectors/high_edges.py FOLDER... --fold 0 --fold 1 --fold 2 --model MODEL.npz... [--twin FOLDER]

It takes 10 s without --model and --twin, 30 s with two models. Prints tables of the flights over one platform, by
class of height:
1. the "over" logit over the platform (median), and its change where one channel is muted (held at 0); each flight by
   the --model that was not trained on it, so the models of a cross-validation can be given together;
2. the same logit where the air before the entry, the platform, or both are replaced by the flight's own hover: how
   much of it comes from the way to the platform, which is a part of the mission and not of the platform's air;
3. standard deviation of the channels in hover and in the last second before the entry: the air in which edges lie;
4. with --twin: standard deviation above 3 Hz over the platform divided by that before it, recorded, and with the
   twin's responses (`airtouch.twin.overlay`) added to the recorded air.
The tables are in host/docs/twin-findings.md.
"""

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from scipy.signal import butter, sosfiltfilt

from airtouch import vehicle
from airtouch.cli.shared.arguments import whole_number
from airtouch.detector import best
from airtouch.detector.best.batches import channels_of
from airtouch.detector.best.model import BestModel
from airtouch.detector.best.network import float_logits
from airtouch.detector.best.recipe import ROW_STRIDE
from airtouch.detector.evaluation.data import dataset
from airtouch.detector.shared import training_set
from airtouch.errors import AirTouchError, in_one_line
from airtouch.logs.flight_log import FlightLog
from airtouch.reference.motion_channels import NAMES
from airtouch.simulation import scenario
from airtouch.twin import adapt_report, files, overlay
from airtouch.twin.overlay import RATE_HZ
from airtouch.twin.recorded.course import Course, course
from airtouch.twin.recorded.features import CLASSES, height_class

CHANNELS = NAMES[:-1]  #: without the empty one
SPLIT_HZ = 3.0  #: Hz, corner of the high-pass whose output is compared; no source: round number
SETTLED, BEFORE = slice(30, -10), slice(-300, -40)  #: samples: over a platform from the entry on; before the entry
AHEAD = 40  #: samples before the entry in which the platform acts already; as `overlay.BEFORE_S`
HOVER_S = 2.0  #: s, shortest hover of a flight in tables 2 and 3; no source: round number
#: parts of a flight that are replaced by a hover
REPLACED = ("as flown", "before: hover", "platform: hover", "both: hover")
#: names of overlay.COLUMNS
COLUMNS = ("ax", "ay", "az", "gyro x", "gyro y", "gyro z", "m1", "m2", "m3", "m4")
RESPONSES = 60  #: simulated responses to a platform; no source: 20 of each height class
SPEED_MPS = 0.3  #: m/s, speed of a course where only its samples are used; no effect on them
Groups = dict[str, list[tuple[FlightLog, Course]]]  #: class of height -> its flights


def over(model: BestModel, values: np.ndarray, path: Course) -> float:
    """Median "over" logit over the platform. values: (n, 12) channels."""
    steps = slice((path.entry + SETTLED.start) // ROW_STRIDE, (path.exit + SETTLED.stop) // ROW_STRIDE)
    return float(np.median(float_logits(model.weights, model.recipe.graph, values)[steps, 0]))


def mute_each_channel(log: FlightLog, path: Course, model: BestModel) -> np.ndarray:
    """(1 + channels,): median "over" logit over the platform, and its changes with each channel held at 0."""
    x, _ = channels_of(log, model.recipe.motion)
    whole = over(model, x, path)
    return np.array([whole, *(over(model, np.where(np.arange(x.shape[1]) == i, 0.0, x), path) - whole
                              for i in range(len(CHANNELS)))])


def hovering(values: np.ndarray, path: Course, before: bool, platform: bool) -> np.ndarray:
    """Channels (n, k) with the air before the entry, the platform, or both replaced by the flight's own hover.

    It ends before the entry as it was flown; from there on, and earlier than it is long, it is repeated there and back,
    so that it has no jumps. Its mean is that of the last second before the entry.
    """
    out, start, middle = values.copy(), path.phases()["hover"].start, path.entry - AHEAD
    hover = values[path.phases()["hover"]]
    hover = hover - hover.mean(axis=0) + values[middle - RATE_HZ:middle].mean(axis=0)
    there_and_back = np.vstack([hover[::-1], hover])
    for replaced, first, last in ((before, start, middle), (platform, middle, path.exit)):
        if replaced:
            out[first:last] = there_and_back[np.arange(first - middle, last - middle) % len(there_and_back)]
    return out


def approach(log: FlightLog, path: Course, model: BestModel) -> np.ndarray:
    """Median "over" logit over the platform, (4,), for each of REPLACED."""
    x, _ = channels_of(log, model.recipe.motion)
    return np.array([over(model, hovering(x, path, before, platform), path)
                     for platform in (False, True) for before in (False, True)])


def fast(values: np.ndarray) -> np.ndarray:
    """The part of values (n, k) above SPLIT_HZ."""
    return sosfiltfilt(butter(2, SPLIT_HZ, "high", fs=RATE_HZ, output="sos"), values, axis=0)


def calm(log: FlightLog, path: Course) -> tuple[np.ndarray, np.ndarray]:
    """Standard deviations (channels,) in hover and in the last second before the entry."""
    x = channels_of(log)[0][:, :len(CHANNELS)]
    return x[path.phases()["hover"]].std(axis=0), x[path.entry - RATE_HZ:path.entry - RATE_HZ // 10].std(axis=0)


def shaking(values: np.ndarray, entry: int, leave: int) -> tuple[np.ndarray, np.ndarray]:
    """Variances (10,) above SPLIT_HZ of overlay.COLUMNS before and over the platform."""
    swift = fast(values)
    return (swift[max(entry + BEFORE.start, 0):max(entry + BEFORE.stop, 1)].var(axis=0),
            swift[entry + SETTLED.start:leave + SETTLED.stop].var(axis=0))


def length(part: slice) -> int:
    """Samples of a phase."""
    return part.stop - part.start


def row(title: str, count: int, values: Sequence[float], form: str) -> str:
    """One line of a Markdown table."""
    return f"| {title} | {count} | " + " | ".join(form.format(v) for v in values) + " |"


def head(first: str, names: Sequence[str]) -> str:
    """The first two lines of a Markdown table."""
    return f"\n| {first} | flights | " + " | ".join(names) + " |\n|" + "---|" * (len(names) + 2)


def main() -> None:
    """Print the tables, by class of height."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", type=Path, nargs="+", help="of recorded flights, each with a manifest.csv")
    parser.add_argument("--fold", type=whole_number(0), action="append",
                        help="only flights of this fold; may be repeated")
    parser.add_argument("--model", type=Path, action="append", default=[], help="a `best` model; may be repeated")
    parser.add_argument("--twin", type=Path, help="folder of `airtouch twin`")
    options = parser.parse_args()
    models = [best.load(path) for path in options.model]
    twin = options.twin and (scenario.load(options.twin / files.SCENARIO),
                             vehicle.load(str(options.twin / files.VEHICLE)))
    groups = by_height([f for f in dataset.collect(options.folders)
                        if not options.fold or f.condition.fold in options.fold])
    hovers = {name: [(log, path) for log, path in group if length(path.phases()["hover"]) > HOVER_S * RATE_HZ]
              for name, group in groups.items()}
    if models:
        print_logits(head("over logit; muted", ["whole", *CHANNELS]), groups, models, mute_each_channel)
        print_logits(head("over logit; replaced", REPLACED), hovers, models, approach)
    print(head("standard deviation, nominal amplitudes", CHANNELS))
    for name, group in hovers.items():
        pairs = [calm(log, path) for log, path in group]
        for title, part in zip(("in hover", "before the entry"), zip(*pairs, strict=True), strict=False):
            print(row(f"{name}, {title}", len(part), np.median(part, axis=0).tolist(), "{:.2f}"), flush=True)
    if twin:
        print_responses(groups, *twin)


def by_height(listed: Sequence[dataset.FlightFile]) -> Groups:
    """Logs and courses by class of height. Raises AirTouchError where a flight is not usable."""
    usable, left_out = adapt_report.readable(listed)
    if left_out:
        raise AirTouchError(left_out[0][1])
    groups: Groups = {name: [] for name in CLASSES}
    for flight in usable:
        path = course(flight.log, SPEED_MPS)
        name = height_class(path.clearance_m)
        if name:
            groups[name].append((flight.log, path))
    return groups


def print_logits(title: str, groups: Groups, models: Sequence[BestModel],
                 logits: Callable[[FlightLog, Course, BestModel], np.ndarray]) -> None:
    """Print a table of median logits: each flight by the models that were not trained on it."""
    print(title)
    for name, group in groups.items():
        values = [logits(log, path, model) for log, path in group for model in models
                  if not training_set.contains(model.metadata, log)]
        if values:
            print(row(name, len(values), np.median(values, axis=0).tolist(), "{:+.1f}"), flush=True)


def print_responses(groups: Groups, scene: scenario.Scenario, craft: vehicle.Vehicle) -> None:
    """Print what a platform adds above SPLIT_HZ, recorded and by the responses of a twin: its scenario and vehicle."""
    responses = overlay.simulate_responses(scene, craft, RESPONSES)
    print(head("above 3 Hz, over the platform / before", COLUMNS))
    for name, group in groups.items():
        pairs = [shaking(overlay.values_of(log), path.entry, path.exit) for log, path in group
                 if path.entry > -BEFORE.start]
        added = [shaking(r.values, *(e.sample for e in r.edges))[1] for r in responses
                 if height_class(r.edges[0].height_after_m) == name]
        if pairs and added:
            before, over = (np.median(part, axis=0) for part in zip(*pairs, strict=True))
            print(row(f"{name}, recorded", len(pairs), np.sqrt(over / before).tolist(), "{:.1f}"))
            both = np.sqrt((before + np.median(added, axis=0)) / before)
            print(row(f"{name}, simulated", len(added), both.tolist(), "{:.1f}"), flush=True)


if __name__ == "__main__":
    with in_one_line("high_edges"):
        main()
