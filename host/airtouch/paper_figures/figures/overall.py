"""Overall errors over platforms, and the method against the paper's baseline (labels Performance:1a and 1c)."""

from airtouch.detector.evaluation import summary
from airtouch.detector.evaluation.score import FlightScore
from airtouch.paper_figures import pictures, recorded, words
from airtouch.paper_figures.claims import CLAIMS
from airtouch.paper_figures.figure import Figure, Job


def errors_m(scores: list[FlightScore]) -> list[float]:
    """Errors of the detected edges, m, positive early, in the order of the flights."""
    return [e.error_m for s in scores for e in s.edges if e.error_m is not None]


def each_m(scores: list[FlightScore]) -> list[float | None]:
    """Errors of all true edges, m, positive early; None for a missed edge."""
    return [e.error_m for s in scores for e in s.edges]


def heights(job: Job) -> Figure:
    """Performance:1a: the errors over platforms, edge by edge."""
    claim = CLAIMS["height-error"]
    scores = {name: recorded.scores(job, name)[0] for name in ("best", "paper")}
    rows = {name: summary.summarise(flights) for name, flights in scores.items()}
    verdict = words.verdict(
        words.reaches(rows["paper"], claim.values[0]),
        f"paper's method {words.score(rows['paper'])}; best {words.score(rows['best'])}"
        + ("; best reaches the claim" if words.reaches(rows["best"], claim.values[0]) else ""))
    caption = (recorded.sample_sentence(job, rows["best"]["flights"], rows["best"]["edges"])
               + " Only edges that were found have an error; those that were missed are counted beside it. The paper "
                 "scores 30 flights of its own, says of no edge that it was missed, and splits windows at random.")
    return Figure("Errors at abrupt heights", [words.table_row(n, r) for n, r in rows.items()], caption,
                  {"height-error": verdict}, lambda canvas: pictures.signed_errors(
                      canvas.subplots(), {n: each_m(s) for n, s in scores.items()}, claim.values[0]))


def against_baseline(job: Job) -> Figure:
    """Performance:1c: best, the paper's method and its baseline, side by side."""
    ours, theirs, gain = CLAIMS["baseline"].values
    scores = {name: recorded.scores(job, name)[0] for name in ("best", "paper", "baseline")}
    rows = {name: summary.summarise(flights) for name, flights in scores.items()}
    gains = {name: words.gain(rows, scores, name, "baseline") for name in ("paper", "best")}
    table = [words.table_row(n, r) for n, r in rows.items()]
    text = (f"paper's method {words.score(rows['paper'])}; baseline {words.score(rows['baseline'])}; best "
            f"{words.score(rows['best'])}. Below the baseline's error: "
            + ", ".join(f"{n} {words.percent(*of)}" for n, of in gains.items()))
    enough = words.gained(gains["paper"], gain - words.SHARE_MARGIN, gain)
    verdict = words.verdict(words.all_of([words.reaches(rows["paper"], ours), enough]), text)

    def draw(canvas):
        left, right = canvas.subplots(1, 2)
        pictures.bars(left, table, "mean_abs_error_m", "error_low_m", "error_high_m", "mean error of detected edges, m")
        pictures.paper_stars(left, {1: ours, 2: theirs})
        pictures.bars(right, table, "missed", "missed_low", "missed_high", "missed edges, %", factor=100.0)

    caption = (recorded.sample_sentence(job, rows["best"]["flights"], rows["best"]["edges"])
               + " Platforms only: no recorded flight crosses a material interface, over which the paper averages too.")
    return Figure("Errors of the method and of the baseline", table, caption, {"baseline": verdict}, draw)
