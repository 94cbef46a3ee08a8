"""Ablations of the paper's choices: loss, time resolution and input size (Performance:1g, 1h and 1i)."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from airtouch.detector.evaluation import summary
from airtouch.detector.evaluation.crossval import Fold
from airtouch.detector.evaluation.score import FlightScore
from airtouch.detector.paper.variants import Variant, VariantModel
from airtouch.logs.flight_log import FlightLog
from airtouch.paper_figures import pictures, recorded, words
from airtouch.paper_figures.claims import CLAIMS, UNTESTABLE
from airtouch.paper_figures.figure import Figure, Job, Verdict

HALF = 0.5  #: fraction of the paper's gain from which a claim is reproduced; no source: half counts, less does not
SURE = 0.95  #: share of the bootstrap draws of flights from which a best size is decided
FEW = 10  #: flights of the small training set, on which the paper says that its loss helps most
EPOCHS, QUICK_EPOCHS = 6, 3  #: epochs of every training here, and with --quick; no source: chosen for time


@dataclass(frozen=True)
class OnTenFlights(Variant):
    """A variant that is trained on FEW of its training flights, drawn by seed."""

    def fit(self, flights: Sequence[FlightLog], seed: int = 0, epochs: int = EPOCHS) -> VariantModel:
        """As `Variant.fit`."""
        drawn = np.random.default_rng(seed).permutation(len(flights))[:FEW]
        return super().fit([flights[i] for i in sorted(drawn)], seed=seed, epochs=epochs)


UNFILTERED = Variant(physical_filter=False)
#: name -> variant, with the names of `airtouch ablate` for variants that it has
LOSSES = {"with the loss": ("paper", Variant()), "without": ("no-df-loss", Variant(df_lambda=0.0)),
          f"with, {FEW} flights": (f"few-{FEW}", OnTenFlights()), f"without, {FEW} flights": (f"few-{FEW}-no-df-loss",
                                                                                    OnTenFlights(df_lambda=0.0))}
RESOLUTIONS = {200: ("no-filter", UNFILTERED), 100: ("stft-100", replace(UNFILTERED, band_window=100)),
               50: ("stft-50", replace(UNFILTERED, band_window=50))}
SIZES = {50: ("input-50", replace(UNFILTERED, rows=50)), 100: ("no-filter", UNFILTERED),
         170: ("input-170", replace(UNFILTERED, rows=170)), 250: ("input-250", replace(UNFILTERED, rows=250))}


def scores(job: Job, name: str, variant: Variant) -> tuple[list[FlightScore], list[Fold]]:
    """Scores of a variant, one for each flight, and its folds."""
    return recorded.variant_scores(job, name, variant, {"epochs": QUICK_EPOCHS if job.quick else EPOCHS})


def df_loss(job: Job) -> Figure:
    """Performance:1g: trained with and without the disturbance-force loss, on all training flights and on ten."""
    recorded.files(job)
    scored = {what: scores(job, *variant) for what, variant in LOSSES.items()}
    rows = {what: summary.summarise(flights) for what, (flights, _) in scored.items()}
    epochs = {what: float(np.mean([f.parameters["converged_after_epochs"] for f in folds]))
              for what, (_, folds) in scored.items()}
    table = [words.table_row(what, r, epochs_to_converge=epochs[what]) for what, r in rows.items()]
    names = list(LOSSES)
    pairs = list(zip(names[::2], names[1::2], strict=True))  # with the loss, without it
    groups = {what: flights for what, (flights, _) in scored.items()}
    gains = {on: words.gain(rows, groups, on, off) for on, off in pairs}
    least = HALF * CLAIMS["df-loss"].values[2]
    text = "; ".join(f"{what} {words.metres(r)}, {words.misses(r)}" for what, r in rows.items())
    helps = words.any_of(words.all_of([words.worse(rows[on], rows[off]), words.gained(gains[on], least, least)])
                         for on, off in pairs)
    sooner = words.any_of(_sooner(scored[on][1], scored[off][1]) for on, off in pairs)
    verdicts = {
        "df-loss": words.verdict(helps, f"{text}; error less by "
                                 + " and ".join(words.percent(*g) for g in gains.values())),
        "df-epochs": words.verdict(sooner,
                                   "epochs until the held-out loss is within 1 % of its lowest, mean of the folds: "
                                   + ", ".join(f"{what} {e:.1f}" for what, e in epochs.items()))}
    if job.quick:
        verdicts["df-epochs"] = Verdict(UNTESTABLE, f"{QUICK_EPOCHS} epochs are too few to see; leave out --quick")
    caption = (f"{_caption(job, rows)} Lambda is 0.1; the paper does not say its own. Dashed: trained on {FEW} "
               "flights, where the paper expects most of it.")
    styles = {what: {"color": pictures.COLOURS["best" if what.startswith("with,") or what == "with the loss"
                                               else "paper"], "ls": "--" if "flights" in what else "-"}
              for what in scored}
    return Figure("The disturbance-force loss", table, caption, verdicts,
                  lambda canvas: pictures.hit_curves(canvas.subplots(), groups, styles))


def time_resolution(job: Job) -> Figure:
    """Performance:1h: windows of the band power of 200, 100 and 50 samples."""
    recorded.files(job)
    rows = {size: summary.summarise(scores(job, *variant)[0]) for size, variant in RESOLUTIONS.items()}
    text = "; ".join(f"{size} samples {words.metres(r)}, {words.misses(r)}" for size, r in rows.items())
    verdict = words.verdict(words.worse(rows[50], rows[200]), text)
    return Figure("Time resolution of FC-FE", [words.table_row(f"{s} samples", r, window=s) for s, r in rows.items()],
                  _caption(job, rows) + " A shorter window resolves time better and frequency worse; the hop is one "
                                        "sample. The paper does not say which windows it compared. Physical filter "
                                        "off.", {"resolution": verdict},
                  lambda canvas: _curves(canvas, rows, "window of the band power, samples"))


def input_size(job: Job) -> Figure:
    """Performance:1i: network inputs of 50, 100, 170 and 250 samples."""
    recorded.files(job)
    scored = {size: scores(job, *variant) for size, variant in SIZES.items()}
    rows = {size: summary.summarise(flights) for size, (flights, _) in scored.items()}
    text = "; ".join(f"{size} samples {words.metres(r)}, {words.misses(r)}" for size, r in rows.items())
    best = max(rows, key=lambda size: rows[size]["hit"]["0.25"])
    low, high = CLAIMS["input-size"].values
    share = best_share({size: flights for size, (flights, _) in scored.items()}, low, high)
    answer = words.decided(share >= SURE, share <= 1.0 - SURE)
    verdict = words.verdict(answer, f"{text}; most edges within 0.25 m with {best}, with 100 to 170 in "
                                    f"{100 * share:.0f} % of the bootstrap draws of flights: "
                            + ", ".join(f"{s} {words.percent(r['hit']['0.25'], r['intervals']['hit']['0.25'])}"
                                        for s, r in rows.items()))
    return Figure("Input size of the network", [words.table_row(f"{s} samples", r, rows=s) for s, r in rows.items()],
                  _caption(job, rows) + " Physical filter off. The best size is the one with most edges within 0.25 m.",
                  {"input-size": verdict}, lambda canvas: _curves(canvas, rows, "network input, samples"))


def best_share(scored: dict[int, list[FlightScore]], low: float, high: float, draws: int = 2000) -> float:
    """Share of the bootstrap draws of flights in which the size with most edges within 0.25 m is from low to high.

    A flight is drawn for all sizes at once (paired), those that every size has a score of. A tie counts in parts.
    """
    of_flight = {size: {s.flight: s for s in flights} for size, flights in scored.items()}
    names = sorted(set.intersection(*(set(flights) for flights in of_flight.values())))
    hits = np.array([[sum(e.error_m is not None and abs(e.error_m) <= 0.25 for e in flights[name].edges)
                      for name in names] for flights in of_flight.values()])
    drawn = np.random.default_rng(0).multinomial(len(names), np.full(len(names), 1 / len(names)), size=draws)
    total = drawn @ hits.T  # every size has the same edges
    best = total == total.max(axis=1, keepdims=True)
    within = np.array([low <= size <= high for size in scored])
    return float(np.mean(best[:, within].sum(axis=1) / best.sum(axis=1)))


def _sooner(with_loss: Sequence[Fold], without: Sequence[Fold]) -> bool | None:
    """Whether training converges sooner by HALF of the paper's gain: in each fold, in none, else (or in one) None."""
    gains = [1.0 - on.parameters["converged_after_epochs"] / off.parameters["converged_after_epochs"]
             for on, off in zip(with_loss, without, strict=True)]
    yes = [gain >= HALF * CLAIMS["df-epochs"].values[2] for gain in gains]
    return words.decided(all(yes), not any(yes)) if len(yes) > 1 else None


def _curves(canvas: Any, rows: dict[int, dict[str, Any]], label: str) -> None:
    left, right = canvas.subplots(1, 2)
    for axes, key, factor, name in ((left, "mean_abs_error_m", 1.0, "mean error of detected edges, m"),
                                    (right, "missed", 100.0, "missed edges, %")):
        sizes = [s for s, r in rows.items() if r[key] is not None]
        pictures.curve(axes, sizes, [rows[s] for s in sizes], key, factor, pictures.COLOURS["paper"])
        axes.set(xlabel=label, ylabel=name, ylim=(0, None))


def _caption(job: Job, rows: dict[Any, dict[str, Any]]) -> str:
    row = next(iter(rows.values()))
    epochs = QUICK_EPOCHS if job.quick else EPOCHS
    return (f"Recorded flights, {row['flights']} held out by flight ({row['edges']} edges), float networks without "
            f"pruning, {epochs} epochs of one cycle.{recorded.left_out(job)}")
