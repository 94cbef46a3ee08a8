"""The camera beside AirTouch: errors against light and network size, and both together (Performance:3b and 3c)."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from airtouch.detector.evaluation import summary, tuning
from airtouch.paper_figures import pictures, recorded, words
from airtouch.paper_figures.claims import CLAIMS, UNTESTABLE
from airtouch.paper_figures.figure import Figure, Job, Missing, Verdict
from airtouch.paper_figures.figures.films import AIRTOUCH, SIZE_LUX, Crossings, crossings, film_scores, films_of, lux_of
from airtouch.vision import teed, weights

BEST_ZEROS = (0.85, 0.0)  #: sparsities of `best` in the plot of error against size
F1_MARGIN = 0.02  #: timed F1 that a fusion may lose to its better sense and still count as no worse; no source: chosen
STEPS = 800  #: training steps of `best`
NAMES = {"classical": "OpenCV", "teed": "TEED's structure"}
COLOURS = {"classical": "#8a6d00", "teed": "#7a3e9d", "half": "#a678c4", "quarter": "#c9aedb", "eighth": "#e0d3ea",
           "fusion": "#1a7f37"}
Summaries = dict[str, dict[str, Any]]  #: detector -> summary of its scores
ByLight = dict[tuple[str, float], dict[str, Any]]  #: (method, lux) -> summary of its scores
LIMITS = ("A rendered scene can say how exposure, blur, noise and frame rate move the error of a line's place. It "
          "cannot say how a real platform looks: no gloss, no shadow of the drone (which at 4 cm hides most of the "
          "light), no lens errors, no rim of its own colour, and the network was trained on the same renderer. The "
          "constant lag of each sense is fitted on other flights of the same simulator.")


def light(job: Job) -> Figure:
    """Performance:3b: errors of the camera and of AirTouch from 500 to 5 lux."""
    data = crossings(job)
    lux = lux_of(job)
    rows = {(name, v): summary.summarise(film_scores(data.films, data.camera[name, v]))
            for v in lux for name in ("classical", "teed")}
    ours = _summaries(data)
    table = [words.table_row(f"{name}, {v:g} lux", row, detector=name, lux=v) for (name, v), row in rows.items()]
    table += [words.table_row(f"{name}, any light", row, detector=name) for name, row in ours.items()]
    caption = (f"Simulated: {len(data.films)} flights, 4 cm over the platform, camera and AirTouch on the same "
               f"flights; frames of 324 x 244 rendered at 6 a second. {LIMITS}")
    return Figure("Errors against light", table, caption, _light_verdicts(rows, ours, lux),
                  lambda canvas: _draw_light(canvas, rows, ours, lux))


def _summaries(data: Crossings) -> Summaries:
    return {name: summary.summarise(film_scores(data.films, data.airtouch[name])) for name in AIRTOUCH}


def _light_verdicts(rows: ByLight, ours: Summaries, lux: Sequence[float]) -> dict[str, Verdict]:
    """The verdicts on the claims about light. rows: the camera's by method and lux. ours: AirTouch's by detector."""
    def text(value: float) -> str:
        return "; ".join(f"{NAMES[n]} at {value:g} lux {words.metres(rows[n, value])}, {words.misses(rows[n, value])}"
                         for n in ("teed", "classical") if (n, value) in rows)

    claimed_m = CLAIMS["light-airtouch"].values[0]
    bright, bright_m = CLAIMS["light-bright"].values
    dark = [v for v in CLAIMS["light-dark"].values if ("teed", v) in rows]
    flights = "; ".join(f"{n} {words.metres(r)}, {words.misses(r)}" for n, r in ours.items())
    best = words.metres(ours["best"])
    return {
        "light-airtouch": words.verdict(
            words.reaches(ours["paper"], claimed_m),
            f"light plays no part in its signals; simulated, shipped networks: {flights}"
            + (f"; best reaches {claimed_m:g} m" if words.reaches(ours["best"], claimed_m) else "")),
        "light-bright": words.verdict(
            words.all_of([words.worse(rows["teed", bright], ours["best"]),
                          words.reaches(rows["teed", bright], bright_m)]),
            f"{text(bright)}; best {best}", "the camera (TEED's structure) against best"),
        "light-dark": words.verdict(words.all_of(words.worse(ours["best"], rows["teed", v]) for v in dark),
                                    "; ".join(text(v) for v in dark) + f"; best {best}. "
                                    + _crossing(rows, ours["best"], lux), "the camera (TEED's structure) against best")}


def _draw_light(canvas: Any, rows: ByLight, ours: Summaries, lux: Sequence[float]) -> None:
    """Draw error and misses of camera and AirTouch against the light."""
    left, right = canvas.subplots(1, 2)
    for axes, key, factor in ((left, "mean_abs_error_m", 1.0), (right, "missed", 100.0)):
        for name in ("classical", "teed"):
            pictures.curve(axes, lux, [rows[name, v] for v in lux], key, factor, COLOURS[name], NAMES[name])
        _airtouch(axes, ours, key, factor)
        for name, row in ours.items():
            if row["intervals"][key]:
                axes.axhspan(*(factor * b for b in row["intervals"][key]), color=pictures.colour(name), alpha=0.12,
                             lw=0)
        pictures.logarithmic(axes, lux, "light, lux")
        axes.set(ylim=(0, None))
    left.plot(*CLAIMS["light-bright"].values, "k*", ms=8, label="paper: TEED")
    left.plot([20, 50, 100], [CLAIMS["light-airtouch"].values[0]] * 3, "k_", ms=9, label="paper: AirTouch")
    _label_axes(canvas, left, right)


def network_size(job: Job) -> Figure:
    """Performance:3c: the camera's errors against the size of its network, AirTouch's against the size of its own."""
    data = crossings(job)
    lux = SIZE_LUX
    rows = {name: summary.summarise(film_scores(data.films, data.camera[name, lux])) for name in weights.SIZES}
    sizes = {name: teed.parameters(weights.SIZES[name]) for name in rows}
    table = [words.table_row(name, r, parameters=sizes[name], bytes=sizes[name], lux=lux) for name, r in rows.items()]
    full, least = rows["teed"], rows["eighth"]
    text = "; ".join(f"{sizes[n]:,} parameters {words.metres(r)}, {words.misses(r)}"
                     for n, r in rows.items())
    ours = _summaries(data)
    by_bytes, airtouch = _airtouch_sizes(job)
    table += [words.table_row(f"best, {size:,} bytes, recorded flights", r, bytes=size)
              for size, r in by_bytes.items()]
    verdicts = {"network-vision": words.verdict(words.worse(full, least), f"at 100 lux {text}", "the camera"),
                "network-airtouch": airtouch}

    def draw(canvas):
        left, right = canvas.subplots(1, 2)
        for axes, key, factor in ((left, "mean_abs_error_m", 1.0), (right, "missed", 100.0)):
            pictures.curve(axes, list(sizes.values()), list(rows.values()), key, factor, COLOURS["teed"],
                           "vision, 100 lux")
            if by_bytes:
                pictures.curve(axes, list(by_bytes), list(by_bytes.values()), key, factor, pictures.colour("best"),
                               "best, recorded flights")
            _airtouch(axes, ours, key, factor)
            axes.axvline(CLAIMS["network-vision"].values[0], color=pictures.PAPER, ls="--", lw=1)
            pictures.logarithmic(axes, list(sizes.values()), "bytes (vision: one a parameter)")
            axes.set(ylim=(0, None))
        _label_axes(canvas, left, right)

    caption = (f"Simulated: the {len(data.films)} flights of fig11b at {SIZE_LUX:g} lux. Widths are divided by 2, 4 "
               f"and 8; each network has the same training. Bytes of the camera's networks are one a parameter, as in "
               "the paper's 53 KB (dashed); here they run in float. Those of best are what the drone carries: int8 "
               f"weights, scales and the places of zeros. {LIMITS}")
    return Figure("Errors against the size of the network", table, caption, verdicts, draw)


def _airtouch_sizes(job: Job) -> tuple[dict[int, dict[str, Any]], Verdict]:
    """Bytes -> summary of `best` at each sparsity, on recorded flights; and the verdict."""
    if job.quick:
        return {}, Verdict(UNTESTABLE, "networks of other sizes are not trained in a quick run; leave out --quick")
    rows = {}
    try:
        for zeros in BEST_ZEROS:
            scores, folds = recorded.variant_scores(job, "best", None, {"steps": STEPS, "sparsity": zeros})
            rows[folds[0].parameters["parameter_bytes"]] = summary.summarise(scores)
    except Missing as missing:
        return {}, Verdict(UNTESTABLE, str(missing))
    text = "; ".join(f"{size:,} bytes {words.metres(r)}, {words.misses(r)}" for size, r in rows.items())
    small, large = rows.values()
    return rows, words.verdict(words.inverse(words.worse(large, small)), f"best on recorded flights: {text}", "best")


def fusion(job: Job) -> Figure:
    """Late fusion of camera and AirTouch: the timed F1 of each and of both at every illuminance."""
    data = crossings(job)
    table: list[dict[str, Any]] = []
    scores: dict[tuple[str, float], float] = {}
    for lux in lux_of(job):
        detections = {"camera": data.camera["teed", lux], "AirTouch": data.airtouch["best"],
                      "both": data.camera["fusion", lux]}
        for name, by_film in detections.items():
            scores[name, lux] = tuning.timed_f1([(f.edges, d) for f, d in zip(data.films, by_film, strict=True)])
            row = summary.summarise(film_scores(data.films, by_film))
            table.append(words.table_row(f"{name}, {lux:g} lux", row, detector=name, lux=lux,
                                         timed_f1=scores[name, lux]))
        table[-1]["fusion_loses"], table[-1]["loses_low"], table[-1]["loses_high"] = _loss(data.films, detections)
    text = "; ".join(f"{v:g} lux: camera {scores['camera', v]:.3f}, AirTouch {scores['AirTouch', v]:.3f}, both "
                     f"{scores['both', v]:.3f}" for v in lux_of(job))
    never_worse, outcome = _outcome([r for r in table if r["detector"] == "both"])
    verdict = words.verdict(never_worse, f"timed F1, {sum(len(f.edges) for f in data.films)} edges: {text}; {outcome}",
                            "best and the camera together")

    def draw(canvas):
        axes = canvas.subplots()
        for name, colour in (("camera", COLOURS["teed"]), ("AirTouch", pictures.COLOURS["best"]),
                             ("both", COLOURS["fusion"])):
            axes.plot(lux_of(job), [scores[name, v] for v in lux_of(job)], "o-", ms=4, color=colour, label=name)
        pictures.logarithmic(axes, lux_of(job), "light, lux")
        axes.set(ylabel="timed F1 (1: every edge, no error)", ylim=(0.5, 1.02))
        axes.legend(fontsize=7, frameon=False)

    caption = (f"Simulated: {len(data.films)} flights. Edges of the camera (TEED's structure) and of best within 0.6 "
               "s are one edge, at a time weighted by the inverse squared errors; errors, and whether edges of one "
               f"sense alone count, are learnt at each light on {films_of(job)[0]} other flights. Timed F1 counts a "
               f"match 1 - |error| / 1.5 s. {LIMITS}")
    return Figure("Camera and AirTouch together", table, caption, {"backup": verdict}, draw)


def _outcome(rows: Sequence[dict[str, Any]]) -> tuple[bool | None, str]:
    """Whether the fusion is nowhere worse than its better sense, None for undecided; in words.

    Yes: the 95 % intervals of the loss end below F1_MARGIN.
    """
    beyond = ", ".join(f"{r['lux']:g} lux" for r in rows if r["loses_low"] > 0.0)
    most = max(r["fusion_loses"] for r in rows)
    if beyond:
        return False, f"both are below the better one beyond the 95 % interval of the difference at {beyond}"
    never = True if max(r["loses_high"] for r in rows) <= F1_MARGIN else None
    if most > 0.0:
        return never, (f"both are below the better one by {most:.3f} at most, and nowhere beyond the 95 % interval of "
                      "the difference")
    return never, f"both are at no light below the better one: {-most:.3f} above it at least"


def _loss(films: Sequence[Any], detections: dict[str, Any], draws: int = 2000) -> tuple[float, float, float]:
    """Timed F1 of the better sense less that of the fusion, and its 95 % interval by bootstrap over flights.

    The terms of the timed F1 are additive over flights, so each bootstrap draw is a sum.
    """
    counts = {n: np.array([len(f.edges) + len(d) for f, d in zip(films, by_film, strict=True)])
              for n, by_film in detections.items()}
    credits = {n: np.array([0.5 * c * tuning.timed_f1([(f.edges, d)])
                            for f, d, c in zip(films, by_film, counts[n], strict=True)])
               for n, by_film in detections.items()}

    def f1(name: str, weights: np.ndarray) -> np.ndarray:
        return 2.0 * (weights @ credits[name]) / np.maximum(weights @ counts[name], 1)

    whole = np.ones(len(films))
    better = max(("camera", "AirTouch"), key=lambda name: f1(name, whole))
    drawn = np.random.default_rng(0).multinomial(len(films), np.full(len(films), 1 / len(films)), size=draws)
    low, high = np.percentile(f1(better, drawn) - f1("both", drawn), [2.5, 97.5])
    return float(f1(better, whole) - f1("both", whole)), float(low), float(high)


def _airtouch(axes: Any, ours: Summaries, key: str, factor: float) -> None:
    """Draw a horizontal line for each of AirTouch's detectors, which do not depend on light."""
    for name, row in ours.items():
        if row[key] is not None:
            axes.axhline(factor * row[key], color=pictures.colour(name), lw=1.2, label=f"AirTouch, {name}")


def _label_axes(canvas: Any, left: Any, right: Any) -> None:
    """Label the axes of errors and of misses, and draw one legend below them."""
    left.set_ylabel("mean error of detected edges, m")
    right.set_ylabel("missed edges, %")
    canvas.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=7, frameon=False)


def _crossing(rows: ByLight, ours: dict[str, Any], lux: Sequence[float]) -> str:
    """The illuminances between which the mean errors of camera and AirTouch cross, in words."""
    errors = [(v, rows["teed", v]["mean_abs_error_m"]) for v in lux if rows["teed", v]["mean_abs_error_m"] is not None]
    crossed = [f"between {a:g} and {b:g} lux" for (a, x), (b, y) in zip(errors, errors[1:], strict=False)
               if (x < ours["mean_abs_error_m"]) != (y < ours["mean_abs_error_m"])]
    if crossed:
        return "The mean errors of the camera and of best cross " + " and ".join(crossed)
    return (f"The mean errors do not cross from {lux[0]:g} to {lux[-1]:g} lux: the camera is the "
            + ("better" if errors and errors[-1][1] < ours["mean_abs_error_m"] else "worse") + " one throughout")
