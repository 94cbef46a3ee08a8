"""Chooses the `best` detector's decoder settings from cross-validated models.

    airtouch crossval --detector best --seed S --out DIR_S      # for some seeds, all by fold or all by day
    python tools/detectors/choose_decoder.py DIR_0 DIR_1 ...    # a minute a folder of 87 flights

Each flight is decoded from the logits of the model that never saw it, once for each folder; with --silence SENSOR from
the log without that sensor. Prints the settings that are best over all folds, and an honest figure for choosing them:
each fold scored with the settings best on the others; a flight counts once, whatever the number of folders.
host/docs/results.md has that figure of the shipped settings. In the JSON of that figure `by_fold` has the settings and
the lag of each fold's scores; `lag_s` and `parameters` are those that are best over all folds.
"""

import argparse
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from airtouch import kernels, logs
from airtouch.cli.shared import output
from airtouch.cli.shared.arguments import whole_number
from airtouch.cli.shared.flights import need_flights
from airtouch.cli.shared.progress import with_bar
from airtouch.detector import best
from airtouch.detector.best.model import BestModel
from airtouch.detector.best.recipe import ROW_STRIDE
from airtouch.detector.evaluation import evaluate
from airtouch.detector.evaluation.data import dataset
from airtouch.detector.evaluation.score import TOLERANCE_S, FlightScore, match, score_flight
from airtouch.detector.evaluation.summary import one_a_flight
from airtouch.detector.shared import sensors
from airtouch.detector.trace import Detection, Trace
from airtouch.errors import AirTouchError, in_one_line
from airtouch.logs.edges import Edge
from airtouch.logs.files import check_free
from airtouch.parameters import SAMPLE_PERIOD_S
from airtouch.reference.edge_decoder import DecoderConfig

FOLDS = "best_fold*.json"  #: files of `airtouch crossval`, one of each fold
MISS_M = 0.3  #: m, cost of a missed edge: an error of this size; no source: round number, 1 s at 0.3 m/s
FALSE_M = 0.02  #: m of mean error, cost of one false edge a minute; no source: round number


@dataclass(frozen=True)
class HeldOutFlight:
    """A flight as the model of its fold sees it, which was not trained on it.

    speed: m/s; true: its edges; flying (n,): samples in the air; over (n,): probability of being over a platform;
    logits (steps, 3) and airborne (steps,): what the decoder reads; minutes: in the air.
    """

    file: dataset.FlightFile
    fold: int | str
    speed: float
    true: list[Edge]
    flying: np.ndarray
    over: np.ndarray
    logits: np.ndarray
    airborne: np.ndarray
    minutes: float

    @property
    def edges(self) -> list[int]:
        """Samples of the true edges."""
        return [e.sample for e in self.true]


def held_out_flight(file: dataset.FlightFile, fold: int | str, model: BestModel,
                    silent: tuple[str, ...]) -> HeldOutFlight:
    """A flight read and run through the model of its fold, without the sensors `silent`."""
    if file.condition.speed_mps is None:
        raise AirTouchError(f"{file.path}: no speed, which turns seconds into metres; add a column speed_mps to the "
                            "manifest.csv beside it")
    log = logs.read(file.path)
    events = best.flight_events(sensors.without(log, silent), model)
    over = np.where(events.airborne, 1.0 / (1.0 + np.exp(-events.logits[:, 0].astype(float))), 0.0)
    return HeldOutFlight(file, fold, file.condition.speed_mps, logs.true_edges(log), logs.airborne(log), over,
                         events.logits[events.ready], events.airborne[events.ready],
                         float(events.airborne.sum()) * SAMPLE_PERIOD_S / 60)


def flights_of(folder: Path, out: Path, silent: tuple[str, ...] = ()) -> list[HeldOutFlight]:
    """Every flight with the model of its own fold in `out`, by what `airtouch crossval` wrote of that fold."""
    files = {file.path.name: file for file in dataset.collect([folder])}
    entries = [json.loads(path.read_text()) for path in sorted(out.glob(FOLDS))]
    if len({entry["fold"] for entry in entries}) != len(entries):
        raise AirTouchError(f"{out}: folds of more than one cross-validation; give a folder with one")
    if absent := {score["file"] for entry in entries for score in entry["per_flight"]} - set(files):
        raise AirTouchError(f"{folder}: no {min(absent)}, which {out} was made of; set AIRTOUCH_FLIGHTS to its folder")
    flights = []
    for entry in with_bar(entries, "logits"):
        model = best.load(out / entry["model"])
        flights += [held_out_flight(files[score["file"]], entry["fold"], model, silent)
                    for score in entry["per_flight"]]
    return flights


def outcomes(flights: list[HeldOutFlight], config: DecoderConfig) -> list[tuple[np.ndarray, int]]:
    """For each flight the delays of the detected edges, s, and the number of false detections."""
    out = []
    for flight in flights:
        at = np.flatnonzero(kernels.edge_decoder(flight.logits, flight.airborne, config)) * ROW_STRIDE
        pairs = match(flight.edges, list(at), TOLERANCE_S / SAMPLE_PERIOD_S)
        delays = np.array([(at[j] - flight.edges[i]) * SAMPLE_PERIOD_S for i, j in pairs])
        out.append((delays, len(at) - len(pairs)))
    return out


def score(flight: HeldOutFlight, config: DecoderConfig, lag: float) -> FlightScore:
    """The flight's score, as `airtouch evaluate` has it, with these settings and this lag."""
    edges = kernels.edge_decoder(flight.logits, flight.airborne, config)
    detections = [Detection(int(i) * ROW_STRIDE, best.KINDS[int(edges[i])]) for i in np.flatnonzero(edges)]
    return score_flight(flight.file.path.name, flight.file.condition, flight.true, flight.flying,
                        Trace(flight.over, detections), lag)


def figures(flights: list[HeldOutFlight], outcomes_of: list[tuple[np.ndarray, int]], lag: float) -> dict[str, float]:
    """Mean error of the detected edges, fraction missed, false a minute."""
    errors = np.concatenate([np.abs(d - lag) * f.speed for f, (d, _) in zip(flights, outcomes_of, strict=True)])
    edges = sum(len(f.edges) for f in flights)
    late = np.concatenate([d - lag for d, _ in outcomes_of])
    return {"error_m": float(errors.mean()) if len(errors) else MISS_M, "missed": 1 - len(errors) / edges,
            "rms_s": float(np.sqrt(np.mean(np.square(late)))) if len(late) else np.nan,
            "false_per_minute": sum(n for _, n in outcomes_of) / sum(f.minutes for f in flights)}


def lag_of(outcomes_of: list[tuple[np.ndarray, int]]) -> float:
    """Median delay, seconds."""
    delays = np.concatenate([d for d, _ in outcomes_of])
    return float(np.median(delays)) if len(delays) else 0.0


def cost(flights: list[HeldOutFlight], outcomes_of: list[tuple[np.ndarray, int]]) -> float:
    """Metres: mean error with misses at MISS_M, and FALSE_M for each false edge a minute."""
    f = figures(flights, outcomes_of, lag_of(outcomes_of))
    return f["error_m"] * (1 - f["missed"]) + MISS_M * f["missed"] + FALSE_M * f["false_per_minute"]


#: for each of some settings, the `outcomes` of all flights
Results = list[list[tuple[np.ndarray, int]]]


def cheapest(flights: list[HeldOutFlight], results: Results) -> int:
    """Index of the settings whose outcomes cost least."""
    return int(np.argmin([cost(flights, outcomes_of) for outcomes_of in results]))


def choices(flights: list[HeldOutFlight], results: Results) -> dict[int | str, tuple[int, float]]:
    """Fold -> (index of the settings that are best on the flights of the other folds, their lag there).

    Raises AirTouchError for a flight of two folds, which would choose the settings that it is scored with.
    """
    fold_of: dict[Path, int | str] = {}
    for flight in flights:
        if fold_of.setdefault(flight.file.path, flight.fold) != flight.fold:
            raise AirTouchError(f"{flight.file.path}: in fold {fold_of[flight.file.path]} of one folder and in "
                                f"{flight.fold} of another; give folders of one kind, all by fold or all by day")
    chosen = {}
    for fold in dict.fromkeys(flight.fold for flight in flights):
        others = [k for k, flight in enumerate(flights) if flight.fold != fold]
        choice = cheapest([flights[k] for k in others], [[of[k] for k in others] for of in results])
        chosen[fold] = choice, lag_of([results[choice][k] for k in others])
    return chosen


def nested(flights: list[HeldOutFlight], settings: list[DecoderConfig],
           results: Results) -> tuple[list[FlightScore], dict[str, dict[str, Any]]]:
    """One score a flight over all folders, with the settings best on the other folds; fold -> its lag and settings."""
    scores: list[FlightScore] = []
    by_fold: dict[str, dict[str, Any]] = {}
    for fold, (choice, lag) in choices(flights, results).items():
        scores += [score(flight, settings[choice], lag) for flight in flights if flight.fold == fold]
        by_fold[str(fold)] = {"lag_s": lag, **asdict(settings[choice])}
    return one_a_flight(scores), by_fold


def candidates(count: int, rng: np.random.Generator, hold: int) -> list[DecoderConfig]:
    """Random settings, drawn without a look at any flight."""
    out = []
    for _ in range(count):
        scores = {"entry_score": rng.uniform(-1, 4), "exit_score": rng.uniform(-1, 4),
                  "late_entry": rng.uniform(-0.5, 4.5), "late_exit": rng.uniform(-4.5, 0)}
        out.append(DecoderConfig(**{name: round(float(value), 2) for name, value in scores.items()}, arm_steps=100,
                                 over_share=float(rng.choice([0.15, 0.3, 0.5, 0.7])),
                                 smooth_gain=float(rng.choice([0.05, 0.08, 0.12, 0.2])),
                                 dwell_steps=int(rng.choice([20, 30, 40])), look_back=50, hold_steps=hold))
    return out


def shipped(silent: Sequence[str]) -> tuple[str, DecoderConfig]:
    """(what they are, the settings that `best` decodes a log without these sensors with)."""
    title = "as shipped"
    if "acceleration" in silent:
        title = "as a model of all sensors has them (for logs without acceleration another model ships)"
    return title, next((best.DECODER_WITHOUT[name] for name in silent if name in best.DECODER_WITHOUT), best.DECODER)


def main() -> None:
    """Search, then print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path, nargs="+", help="folders of `airtouch crossval --detector best --out`")
    parser.add_argument("--count", type=whole_number(1), default=1000, help="settings tried (default %(default)s)")
    parser.add_argument("--hold", type=whole_number(0),
                        help="steps after its crossing at which an edge is reported (default: as shipped)")
    parser.add_argument("--silence", action="append", choices=sensors.SENSORS, default=[],
                        help="decode the flights without this sensor")
    parser.add_argument("--json", type=Path, help="write the honest figure here, for tools/detectors/sensor_figures.py")
    parser.add_argument("--force", action="store_true", help="replace --json if it is there")
    options = parser.parse_args()
    check_free(options.json, options.force)
    for out in options.out:
        if not any(out.glob(FOLDS)):
            raise AirTouchError(f"{out}: no models of `best`: airtouch crossval --detector best --out {out}")
    flights = [flight for out in options.out for flight in flights_of(need_flights(), out, tuple(options.silence))]
    title, config = shipped(options.silence)
    hold = config.hold_steps if options.hold is None else options.hold
    settings = candidates(options.count, np.random.default_rng(0), hold)
    results = [outcomes(flights, candidate) for candidate in with_bar(settings, "settings")]
    print_figures(title, flights, outcomes(flights, config))
    print_figures(f"{title}, but reporting at once", flights, outcomes(flights, replace(config, hold_steps=0)))
    winner = cheapest(flights, results)
    print_figures("one setting, best over all folds", flights, results[winner])
    print(json.dumps(asdict(settings[winner])))
    scores, by_fold = nested(flights, settings, results)
    result = {**evaluate.as_json("best", scores, [], lag_of(results[winner]), asdict(settings[winner])),
              "by_fold": by_fold}
    output.print_table(output.console(), {"best": result, **result["by_height"]},
                            "each fold with the settings best on the others")
    if options.json:
        output.write_json(options.json, result, options.force)


def print_figures(title: str, flights: list[HeldOutFlight], outcomes_of: list[tuple[np.ndarray, int]]) -> None:
    """One line of figures."""
    lag = lag_of(outcomes_of)
    print(f"{title}: {_text(figures(flights, outcomes_of, lag))}, lag {lag:.2f} s")


def _text(f: dict[str, float]) -> str:
    """The figures of a decoder as a line."""
    return (f"error {1000 * f['error_m']:.1f} mm ({f['rms_s']:.2f} s rms), missed {f['missed']:.1%}, "
            f"false {f['false_per_minute']:.2f} a minute")


if __name__ == "__main__":
    with in_one_line("choose_decoder"):
        main()
