"""Prints in how many of neural-swarm's flights under another vehicle a test that knows the seconds sees the wake.

    python tools/diagnosis/gap_wakes.py [FLIGHTS] [--part build|all] [--answers x.jsonl]    # 15 s

The seconds come from the other vehicles' own logs, where the data hold a cut of the same time: another vehicle within
0.15 m sideways and 0.1 to 0.6 m above, as the data's labels say. In these seconds against the rest of the flight: the
mean force along z, the power of that force above 1 Hz, and the power of the yaw torque from 2 to 20 Hz. The same
three are taken of nominal flights of the same vehicle and kind of flying, in the same seconds shifted along the flight
by each half second. A flight is seen where one of the three is beyond all but a third of one per cent of these, which
makes 1 % false alarms. --answers: what `gap_real.py --keep` wrote, to print what the diagnosis says beside it.
build: days 19 and 20.

    python tools/diagnosis/gap_wakes.py [FLIGHTS] --false-alarms    # what the diagnosis says of nominal flights, 15 min

Each nominal flight of days 19 and 20 against the others of its group (`gap_real.py --rows nominal`), as if another
vehicle had been overhead in the seconds of each downwash flight of its kind: how often a wake passes for one there.

    python tools/diagnosis/gap_wakes.py [FLIGHTS] --without-seconds    # a test without the seconds, 3 to 5 min

Of the wakes and the nominal flights of days 19 and 20: how well each measure by which the diagnosis knows a wake tells
the two apart. The figures of all three are in host/docs/gap-real.md.
"""

import argparse
import os
import sys
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
import numpy as np
from scipy.signal import butter, sosfiltfilt

from airtouch import vehicle as vehicles
from airtouch.cli.shared.flights import check_data_set
from airtouch.detector.evaluation.bootstrap import resampled
from airtouch.errors import in_one_line
from airtouch.gap.evidence.data import Data
from airtouch.gap.flights.flight import GROUND, PERIOD_S, Flight, ready
from airtouch.gap.naming.passing_effect import passing_evidence
from airtouch.gap.naming.policy import PASSING_GAIN
from airtouch.gap.nominal import calibrate
from airtouch.gap.nominal.apparent import passing_sizes
from airtouch.gap.passing import gates, overhead
from airtouch.gap.passing.bursts import UNSTEADY_YAW
from airtouch.gap.passing.one_sided import DOWNWARD
from airtouch.gap.sealed.intervals import auroc, share_text
from airtouch.gap.signals.channels import residual
from airtouch.gap.signatures.signature import OVERHEAD
from airtouch.gap.study import Study
from airtouch.logs import json_lines, read
from recordings import cases, swarm_cuts
from recordings.folder import add_folder

LEAST_S = 0.5  #: s under another vehicle that the data must show; no source: round number
LEAST_SHIFTED = 0.5  #: fraction of LEAST_S that must be usable in a nominal flight; no source: round number
STEP_S = 0.5  #: s by which the seconds are shifted along nominal flights; no source: round number
FALSE_ALARMS = 0.01  #: of nominal flights that may be beyond a limit, all MEASURES together; no source: round number
#: Hz above which force is shaking, and band of the yaw torque; no source: round numbers
FORCE_HZ, YAW_HZ = 1.0, (2.0, 20.0)
#: names of what `measures` gives
MEASURES = ("mean force", "its shaking", "yaw torque")
DRAWS = 2000  #: of flights, for an interval


@dataclass(frozen=True)
class Track:
    """A cut of a log: force along z (n,) over gravity and its fast part, fast yaw torque (n,), usable samples (n,)."""

    row: swarm_cuts.Row
    place: np.ndarray  #: x, y, z, m
    force: np.ndarray
    shaking: np.ndarray
    yaw: np.ndarray
    usable: np.ndarray


def track(folder: Path, row: swarm_cuts.Row) -> Track:
    """The track of one cut in the data's folder."""
    vehicle = vehicles.load(folder / f"{row['vehicle']}.toml")
    flight: Flight = ready(read(folder / "flights" / row["file"]), vehicle)
    unexplained = np.nan_to_num(residual(flight, vehicle))
    usable = flight.usable & ~flight.bridged & (flight.phase != GROUND)
    force = np.where(usable, unexplained[:, 2], 0.0) / vehicle.gravity_mps2
    fast = sosfiltfilt(butter(2, FORCE_HZ, "highpass", fs=1.0 / PERIOD_S, output="sos"), force)
    yaw = sosfiltfilt(butter(2, YAW_HZ, "bandpass", fs=1.0 / PERIOD_S, output="sos"),
                      np.where(usable, unexplained[:, 5], 0.0))
    place = np.column_stack([flight.log[name] for name in overhead.PLACE])
    return Track(row, place, force, fast, yaw, usable)


def under(one: Track, other: Track) -> np.ndarray:
    """Samples (n,) at which another vehicle is above; False where its cut does not reach."""
    shift = -round(swarm_cuts.delay_s(one.row, other.row) / PERIOD_S)
    place = np.full_like(one.place, np.nan)
    index = np.arange(len(place)) + shift
    inside = (index >= 0) & (index < len(other.place))
    place[inside] = other.place[index[inside]]
    return overhead.above(one.place, place)


def measures(t: Track, acts: np.ndarray) -> np.ndarray:
    """The three MEASURES (3,) of samples `acts` (n,) against the others: the mean force down, over gravity, logs of
    ratios of power."""
    inside, outside = acts & t.usable, ~acts & t.usable

    def log_ratio(x: np.ndarray) -> float:
        """Natural logarithm of the ratio of the powers of a signal (n,)."""
        return float(np.log(np.mean(x[inside] ** 2) / np.mean(x[outside] ** 2)))
    return np.array([t.force[outside].mean() - t.force[inside].mean(), log_ratio(t.shaking), log_ratio(t.yaw)])


def chance(acts: np.ndarray, nominal: list[Track]) -> np.ndarray:
    """MEASURES (shifts, 3) of nominal flights at the same seconds, shifted around each flight."""
    out, step = [], int(STEP_S / PERIOD_S)
    for t in nominal:
        n = len(t.force)
        own = np.resize(acts, n) if len(acts) < n else acts[:n]
        for shift in range(0, n, step):
            shifted = np.roll(own, shift)
            if (shifted & t.usable).sum() * PERIOD_S > LEAST_SHIFTED * LEAST_S:
                out.append(measures(t, shifted))
    return np.array(out)


def overhead_at(one: Track, tracks: list[Track]) -> np.ndarray:
    """Samples (n,) at which any vehicle of the same flight is above, as far as the data hold its path."""
    partners = [t for t in tracks if swarm_cuts.partners(one.row, t.row)]
    return np.logical_or.reduce([np.zeros(len(one.place), bool), *(under(one, t) for t in partners)])


def show_false_alarms(flights: Path, tracks: list[Track]) -> None:
    """Print how often the diagnosis names a wake in seconds of nominal flights, in which there is none."""
    seconds_of: dict[tuple[str, str], list[tuple[tuple[float, float], ...]]] = {}
    for t in (t for t in tracks if t.row.get("truth") == "downwash"):
        acts = overhead.stretches_s(overhead_at(t, tracks))
        if sum(b - a for a, b in acts) >= LEAST_S:
            seconds_of.setdefault((t.row["vehicle"], t.row["manoeuvre"]), []).append(acts)
    kind = {t.row["file"]: (t.row["vehicle"], t.row["manoeuvre"]) for t in tracks}
    alarms, trials = [], 0
    for case in cases.nominal(flights, "build"):
        name = Path(case.flight).name
        if name not in kind:
            continue
        vehicle = vehicles.load(case.vehicle)
        base = [ready(read(b), vehicle) for b in case.baseline]
        study, flight = calibrate.calibrated(vehicle, base)[0], ready(read(case.flight), vehicle)
        for seconds in seconds_of.get(kind[name], []):
            data = Data(overhead.with_overhead(study, flight, seconds), [flight])
            wake = gates.passing_effects(data).get(gates.KNOWN_OVERHEAD)
            trials += 1
            if wake is not None and passing_evidence(data, wake.key, wake.gain, wake.strength) >= PASSING_GAIN:
                alarms.append(name)
        print(f"{name}: {alarms.count(name)} of {len(seconds_of.get(kind[name], []))}", flush=True)
    print(f"a wake named in nominal flights, seconds known: {share_text(len(alarms), trials, 1)}, "
          f"in {len(set(alarms))} flights")


def show_without_seconds(flights: Path) -> None:
    """Print how well each measure of a wake tells wakes from nominal flights, by vehicle."""
    studies: dict[tuple[str, ...], Study] = {}
    of_truth: dict[tuple[str, str], list[dict[str, float]]] = defaultdict(list)
    nominal = [c for c in cases.nominal(flights, "build") if "neuralswarm" in Path(c.flight).parts]
    for case in [*cases.swarm(flights, "build"), *nominal]:
        if case.truth == "ground_effect":
            continue
        vehicle = vehicles.load(case.vehicle)
        if case.baseline not in studies:
            base = [ready(read(b), vehicle) for b in case.baseline]
            studies[case.baseline] = calibrate.calibrated(vehicle, base, scatter=False)[0]
        data = Data(studies[case.baseline], [ready(read(case.flight), vehicle)])
        of_truth[vehicle.name, case.truth].append(passing_sizes(data))
        print(f"{Path(case.flight).name}", file=sys.stderr, flush=True)
    print("| vehicle | measure | AUROC, 95 % interval | wakes beyond every nominal flight |\n|---|---|---|---|")
    for vehicle_name in sorted({name for name, _ in of_truth}):
        for measure in (OVERHEAD, UNSTEADY_YAW, DOWNWARD):
            wakes, calm = (np.array([sizes[measure] for sizes in of_truth[vehicle_name, truth]])
                           for truth in ("downwash", "none"))
            area, (low, high) = auroc(wakes.tolist(), calm.tolist()), auroc_interval(wakes, calm)
            print(f"| {vehicle_name} | {measure} | {area:.2f} [{low:.2f}, {high:.2f}] | "
                  f"{(wakes > calm.max()).sum()} of {len(wakes)}, of {len(calm)} |")


def auroc_interval(wakes: np.ndarray, calm: np.ndarray) -> np.ndarray:
    """95 % interval (2,) of the AUROC by a bootstrap over flights."""
    return resampled(lambda i, k: auroc(wakes[i].tolist(), calm[k].tolist()), len(wakes), len(calm),
                     replicates=DRAWS, level=0.95)


def answers_of(path: Path | None) -> dict[str, str]:
    """A flight's file -> the first effect, or the verdict, in what `gap_real.py --keep` wrote; empty without a file."""
    return {case["flight"]: case["effects"][0]["name"] if case["effects"] else case["verdict"]
            for case in json_lines.read(path)}


def seconds_under(one: Track, tracks: list[Track]) -> tuple[np.ndarray, float]:
    """Samples (n,) at which another vehicle is above, as far as the data hold its path, and the usable seconds of
    them."""
    acts = overhead_at(one, tracks)
    return acts, float((acts & one.usable).sum() * PERIOD_S)


def named_by_path(tracks: list[Track], answer_of: dict[str, str]) -> dict[bool, list[bool]]:
    """Whether the data hold the other vehicle's path over LEAST_S -> whether each such flight's answer is a wake."""
    named: dict[bool, list[bool]] = {True: [], False: []}
    for t in (t for t in tracks if t.row.get("truth") == "downwash"):
        named[seconds_under(t, tracks)[1] >= LEAST_S].append(answer_of.get(t.row["file"]) == OVERHEAD)
    return named


def show_seen(tracks: list[Track], answers: Path | None) -> None:
    """Print a line for each flight under another vehicle, and for each vehicle how many the test sees."""
    nominal = [t for t in tracks if t.row.get("truth", "none") == "none"]
    answer_of = answers_of(answers)
    table: dict[str, list[bool]] = {}
    print(f"| flight | under, s | {' | '.join(MEASURES)} | seen | the diagnosis |\n|---|---|---|---|---|---|---|")
    for t in (t for t in tracks if t.row.get("truth") == "downwash"):
        acts, seconds = seconds_under(t, tracks)
        if seconds < LEAST_S:
            print(f"| {t.row['file']} | {seconds:.1f} of {t.row['s_under']} | | | | less than {LEAST_S:g} s held | "
                  f"{answer_of.get(t.row['file'], '')} |")
            continue
        like = [n for n in nominal if (n.row["vehicle"], n.row["manoeuvre"]) == (t.row["vehicle"], t.row["manoeuvre"])]
        of_nominal = chance(acts, like)
        limit = np.quantile(of_nominal, 1.0 - FALSE_ALARMS / len(MEASURES), axis=0)
        own = measures(t, acts)
        hit = bool((own > limit).any())
        table.setdefault(t.row["vehicle"], []).append(hit)
        cells = " | ".join(f"{m:.2f} ({u:.2f})" for m, u in zip(own, limit, strict=True))
        print(f"| {t.row['file']} | {seconds:.1f} of {t.row['s_under']} | {cells} | {'yes' if hit else 'no'} | "
              f"{answer_of.get(t.row['file'], '')} |", flush=True)
    for vehicle, hits in table.items():
        print(f"{vehicle}: seen {share_text(sum(hits), len(hits))}")
    named = named_by_path(tracks, answer_of)
    print(f"{len(named[False])} more, for which the data hold less than {LEAST_S:g} s of a path overhead")
    if answers:
        print(f"the diagnosis names a wake in {share_text(sum(named[True]), len(named[True]))} where the data hold "
              f"at least {LEAST_S:g} s of the path, in {share_text(sum(named[False]), len(named[False]))} where less")


def main() -> None:
    """Print how many wakes the test sees, or the false alarms of the diagnosis."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add_folder(parser, name="flights")
    parser.add_argument("--part", choices=("build", "all"), default="build",
                        help="days 19 and 20, or all days (default %(default)s)")
    parser.add_argument("--answers", type=Path, help="what `gap_real.py --keep` wrote")
    parser.add_argument("--false-alarms", action="store_true", help="what the diagnosis says of nominal flights")
    parser.add_argument("--without-seconds", action="store_true", help="what a test without the seconds sees")
    options = parser.parse_args()
    check_data_set(options.flights / "neuralswarm")
    if options.without_seconds:
        show_without_seconds(options.flights)
        return
    folder = options.flights / "neuralswarm"
    all_days = options.part == "all" and not options.false_alarms
    rows = [r for r in swarm_cuts.cuts(folder) if all_days or r["day"] in cases.BUILD_DAYS]
    tracks = [track(folder, r) for r in rows if r.get("truth") != "ground_effect"]
    if options.false_alarms:
        show_false_alarms(options.flights, tracks)
    else:
        show_seen(tracks, options.answers)


if __name__ == "__main__":
    with in_one_line("gap_wakes"):
        main()
