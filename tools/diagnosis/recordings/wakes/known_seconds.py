"""A test of wakes that knows when a vehicle was under another, beside what the diagnosis names."""

from pathlib import Path

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.gap.flights.flight import PERIOD_S
from airtouch.gap.sealed.intervals import share_text
from airtouch.gap.signatures.signature import OVERHEAD
from airtouch.logs import json_lines

from ..result_store import REFUSED
from .tracks import LEAST_S, Track, seconds_under

LEAST_SHIFTED = 0.5  #: fraction of LEAST_S that must be usable in a nominal flight; no source: round number
STEP_S = 0.5  #: s by which the seconds are shifted along nominal flights; no source: round number
FALSE_ALARMS = 0.01  #: of nominal flights that may be beyond a limit, all MEASURES together; no source: round number
#: names of what `measures` gives
MEASURES = ("mean force", "its shaking", "yaw torque")


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


def answers_of(path: Path | None) -> dict[str, str]:
    """A flight's file -> the first effect, or the verdict, in what `gap_real.py --keep` wrote; empty without a file.

    Raises AirTouchError for a flight that was diagnosed more than once, as with --partner and without.
    """
    answers: dict[str, str] = {}
    for result in json_lines.read(path):
        if result["row"] != "swarm" or result.get("left_out") or result["verdict"] == REFUSED:
            continue
        if result["flight"] in answers:
            raise AirTouchError(f"{path}: {result['flight']} was diagnosed more than once, as with --partner and "
                                "without, or by two versions; keep the results of one run in a file of its own")
        answers[result["flight"]] = result["effects"][0]["name"] if result["effects"] else result["verdict"]
    return answers


def named_by_path(tracks: list[Track], answer_of: dict[str, str]) -> dict[bool, list[bool]]:
    """Whether the data hold the other vehicle's path over LEAST_S -> whether each such flight's answer is a wake."""
    named: dict[bool, list[bool]] = {True: [], False: []}
    for t in (t for t in tracks if t.row.get("truth") == "downwash"):
        named[seconds_under(t, tracks)[1] >= LEAST_S].append(answer_of.get(t.row["file"]) == OVERHEAD)
    return named


def show_detected(tracks: list[Track], answer_of: dict[str, str]) -> None:
    """Print a line for each flight under another vehicle, and for each vehicle how many the test detects.

    answer_of: what the diagnosis says of a flight, by its file (`answers_of`); may be empty.
    """
    nominal = [t for t in tracks if t.row.get("truth", "none") == "none"]
    table: dict[str, list[bool]] = {}
    print(f"| flight | under, s | {' | '.join(MEASURES)} | detected | the diagnosis |\n|---|---|---|---|---|---|---|")
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
        print(f"{vehicle}: detected {share_text(sum(hits), len(hits))}")
    named = named_by_path(tracks, answer_of)
    print(f"{len(named[False])} more, for which the data hold less than {LEAST_S:g} s of a path overhead")
    if answer_of:
        print(f"the diagnosis names a wake in {share_text(sum(named[True]), len(named[True]))} where the data hold "
              f"at least {LEAST_S:g} s of the path, in {share_text(sum(named[False]), len(named[False]))} where less")
