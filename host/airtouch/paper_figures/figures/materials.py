"""Errors over material interfaces (labels Performance:1b and 1f), from the simulator alone."""

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from airtouch.detector import registry
from airtouch.detector.evaluation import summary
from airtouch.detector.evaluation.score import FlightScore
from airtouch.logs.flight_log import FlightLog
from airtouch.paper_figures import pictures, simulated, words
from airtouch.paper_figures.claims import CLAIMS, UNTESTABLE
from airtouch.paper_figures.figure import Figure, Job, Verdict
from airtouch.paper_figures.figures.overall import each_m, errors_m

#: scenario -> the pair as the paper names it
PAIRS = {"paper-mat-cement": "mat and cement", "paper-grass-cement": "artificial grass and cement",
         "paper-water-cement": "water and cement", "paper-grass-mat": "artificial grass and mat"}
DETECTORS = ("best", "paper")
TRAINING_SEED = 21  #: of the flights trained on; those scored have `simulated.SEED`
CIRCULAR = ("no recorded flight crosses a material, and the simulator's material factors were set to give the paper's "
            "order, so that these figures cannot test it")


def pair_scores(job: Job) -> dict[tuple[str, str], list[FlightScore]]:
    """(detector, scenario) -> scores of detectors trained on other simulated flights over all four pairs."""
    return _pair_scores(job.quick, job.tell)


@cache
def _pair_scores(quick: bool, tell: Callable[[str], None]) -> dict[tuple[str, str], list[FlightScore]]:
    """(detector, scene) -> scores of simulated flights over two materials, by a detector trained on others of them."""
    training_flights, scored = (8, 6) if quick else (20, 15)
    options: dict[str, dict[str, Any]] = {"best": {"steps": 300 if quick else 800},
                                          "paper": {"epochs": 3 if quick else 6}}
    training = [log for scene in PAIRS for log in _flights(scene, training_flights, TRAINING_SEED)]
    test = {scene: _flights(scene, scored, simulated.SEED) for scene in PAIRS}
    result = {}
    for name in DETECTORS:
        tell(f"{name}: training on {len(training)} simulated flights over materials")
        model = registry.get(name).fit(training, **options[name])
        for scene, flights in test.items():
            result[name, scene] = simulated.scores(flights, name, model)
    return result


def _flights(scene: str, count: int, seed: int) -> list[FlightLog]:
    return [simulated.with_truth(log) for log in simulated.flights(scene, count, seed=seed)]


def overall(job: Job) -> Figure:
    """Performance:1b: the errors over all four pairs, edge by edge."""
    claim = CLAIMS["material-error"]
    scores = pair_scores(job)
    whole = {name: [s for (n, _), flights in scores.items() if n == name for s in flights] for name in DETECTORS}
    rows = {name: summary.summarise(flights) for name, flights in whole.items()}
    text = "; ".join(f"{n} {words.score(r)}" for n, r in reversed(rows.items()))
    return Figure("Errors at material interfaces", [words.table_row(n, r) for n, r in rows.items()], _caption(scores),
                  {"material-error": Verdict(UNTESTABLE, f"{CIRCULAR}; simulated: {text}")},
                  lambda canvas: pictures.signed_errors(
                      canvas.subplots(), {n: each_m(s) for n, s in whole.items()}, claim.values[0]))


def by_pair(job: Job) -> Figure:
    """Performance:1f: the errors of each pair."""
    scores = pair_scores(job)
    rows = {key: summary.summarise(flights) for key, flights in scores.items()}
    table = []
    for (name, scene), row in rows.items():
        errors = np.abs(errors_m(scores[name, scene]))
        table.append(words.table_row(f"{name}, {PAIRS[scene]}", row, detector=name, pair=PAIRS[scene],
                                     median_error_m=float(np.median(errors)) if len(errors) else None,
                                     greatest_error_m=float(errors.max()) if len(errors) else None,
                                     share_0_01_to_0_05=float(((errors >= 0.01) & (errors <= 0.05)).mean())
                                     if len(errors) else None))

    def text(scene: str) -> str:
        return "; ".join(f"{n} median {_number(r['median_error_m'])}, greatest {_number(r['greatest_error_m'])}, "
                         f"{words.percent(r['share_0_01_to_0_05'])} between 0.01 and 0.05 m, {r['edges']} edges, "
                         f"{words.percent(r['missed'])} missed"
                         for n in reversed(DETECTORS) for r in table
                         if r["detector"] == n and r["pair"] == PAIRS[scene])

    verdicts = {name: Verdict(UNTESTABLE, f"{CIRCULAR}; simulated: {text(scene)}")
                for name, scene in (("mat-cement", "paper-mat-cement"), ("water-cement", "paper-water-cement"))}

    def draw(canvas):
        """Draw the errors at each pair of materials as boxes, with the share missed."""
        for axes, name in zip(canvas.subplots(1, 2, sharey=True), DETECTORS, strict=True):
            axes.boxplot([np.abs(errors_m(scores[name, scene])) for scene in PAIRS], widths=0.6, whis=(0, 100),
                         medianprops={"color": pictures.colour(name)})
            axes.set_xticks(range(1, 5), [p.replace(" and ", "\n").replace("artificial ", "") for p in PAIRS.values()],
                            fontsize=7)
            for place, scene in enumerate(PAIRS, start=1):
                row = rows[name, scene]
                axes.text(place, -0.03, f"{100 * row['missed']:.0f} %\nmissed", ha="center", va="top", fontsize=6,
                          color=pictures.GREY)
            axes.set(title=name, ylim=(-0.11, 0.5))
        median, greatest = CLAIMS["mat-cement"].values
        canvas.axes[1].plot([1, 1], [median, greatest], "k*", ms=7, label="paper: mat, cement: median, greatest")
        canvas.axes[1].legend(fontsize=7, frameon=False)
        canvas.axes[0].set_ylabel("|error| of detected edges, m")

    return Figure("Errors by pair of materials", table, _caption(scores), verdicts, draw)


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f} m"


def _caption(scores: dict[tuple[str, str], list[FlightScore]]) -> str:
    flights = len(next(iter(scores.values())))
    return (f"Simulated: {flights} flights a pair, cruising 3.8 to 4.5 cm over the surface at 0, 10 and 20 degrees; "
            "both detectors trained on other simulated flights over the four pairs. Truth is where the drone is. How "
            "a material changes the lift is not measured but set so that the order of the paper comes out.")
