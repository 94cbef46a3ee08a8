"""What each part is worth: cross-validation with one thing changed at a time."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from airtouch.detector.evaluation import crossval, evaluate, summary
from airtouch.detector.evaluation.crossval import Fold
from airtouch.detector.evaluation.data.dataset import FlightFile
from airtouch.detector.evaluation.score import FlightScore
from airtouch.detector.paper.variants import Variant
from airtouch.detector.registry import Detector, InFloat, InFloatOnly, get
from airtouch.errors import AirTouchError
from airtouch.reference.motion_channels import NAMES

HORIZONTAL = ("ax", "ay")
RATES = ("gyro x", "gyro y", "gyro z")
TURNS = ("motor roll", "motor pitch", "motor yaw")
VERTICAL = ("az", "motor mean", "unexplained az")


@dataclass(frozen=True)
class Ablation:
    """One row: a detector and how it is changed; the registered one of this name, or a variant."""

    group: str
    title: str
    variant: Detector | None = None
    name: str = "best"
    options: dict[str, Any] = field(default_factory=dict)


def _only(group: str, title: str, *channels: str) -> Ablation:
    """The ablation of `best` with these motion channels alone."""
    muted = tuple(i for i, name in enumerate(NAMES[:-1]) if name not in channels)
    return Ablation(group, title, options={"muted": muted})


#: name -> ablation; the first of each group is what the others are held against
ABLATIONS: dict[str, Ablation] = {
    "paper": Ablation("paper", "paper, float, unpruned", Variant()),
    "no-df-loss": Ablation("paper", "without the disturbance-force loss", Variant(df_lambda=0.0)),
    "strong-df-loss": Ablation("paper", "disturbance-force loss at lambda 1", Variant(df_lambda=1.0)),
    "no-filter": Ablation("paper", "without the physical filter", Variant(physical_filter=False)),
    "no-filter-no-df": Ablation("paper", "without both", Variant(physical_filter=False, df_lambda=0.0)),
    "stft-100": Ablation("paper", "STFT window 100, filter off", Variant(physical_filter=False, band_window=100)),
    "stft-50": Ablation("paper", "STFT window 50, filter off", Variant(physical_filter=False, band_window=50)),
    "stft-centred": Ablation("paper", "STFT window centred (not causal), filter off",
                             Variant(physical_filter=False, centred=True)),
    "input-50": Ablation("paper", "network input 50 samples, filter off", Variant(physical_filter=False, rows=50)),
    "input-170": Ablation("paper", "network input 170 samples, filter off", Variant(physical_filter=False, rows=170)),
    "best": Ablation("channels", "best, all channels"),
    "imu-only": _only("channels", "IMU only", "ax", "ay", "az", *RATES),
    "motors-only": _only("channels", "motors only", *TURNS, "motor mean"),
    "vertical-only": _only("channels", "vertical only (az, motor mean, unexplained az)", *VERTICAL),
    "no-vertical": _only("channels", "without the vertical channels", *HORIZONTAL, *RATES, *TURNS),
    "horizontal-only": _only("channels", "horizontal acceleration and rates only", *HORIZONTAL, *RATES),
    "f_w-only": _only("channels", "unexplained vertical acceleration only (f_w / m)", "unexplained az"),
    "no-kick": _only("channels", "without motor mean and raw az (height loop's kick)", *HORIZONTAL, *RATES, *TURNS,
                     "unexplained az"),
    "flights-10": Ablation("flights", "10 training flights", options={"most_flights": 10}),
    "flights-20": Ablation("flights", "20 training flights", options={"most_flights": 20}),
    "flights-40": Ablation("flights", "40 training flights", options={"most_flights": 40}),
    "paper-0": Ablation("size", "paper, no pruning", None, "paper", {"sparsity": 0.0}),
    "paper-80": Ablation("size", "paper, 80 % zeros (shipped)", None, "paper", {"sparsity": 0.8}),
    "paper-90": Ablation("size", "paper, 90 % zeros", None, "paper", {"sparsity": 0.9}),
    "sparsity-0": Ablation("size", "best, no pruning", options={"sparsity": 0.0}),
    "sparsity-50": Ablation("size", "best, 50 % zeros (shipped)"),
    "sparsity-70": Ablation("size", "best, 70 % zeros", options={"sparsity": 0.7}),
    "sparsity-85": Ablation("size", "best, 85 % zeros", options={"sparsity": 0.85}),
    "width-16": Ablation("size", "best, width 16, no pruning", options={"width": 16, "sparsity": 0.0}),
}


def ablate(
    names: Sequence[str], files: Sequence[FlightFile], out: Path, *, seed: int = 0,
    best_options: dict[str, Any] | None = None, paper_options: dict[str, Any] | None = None,
    tell: Callable[[str], None] = lambda _: None,
) -> dict[str, dict[str, Any]]:
    """Summary of each ablation over the folds, by name, with `group`, `what`, `seconds` and per-fold `folds`.

    Finished folds are kept in `out`. best_options, paper_options: options of every fit of that detector. tell: called
    with a line for each ablation and fold, and with the reason of each flight that is left out, once.
    """
    results = {}
    reasons: set[str] = set()
    for number, name in enumerate(names, start=1):
        ablation = ABLATIONS[name]
        tell(f"{number}/{len(names)} {name}: {ablation.title}")
        detector = ablation.variant or get(ablation.name)
        shared = best_options if ablation.variant is None and ablation.name == "best" else paper_options
        result = crossval.crossval(
            f"variant-{name}" if ablation.variant else ablation.name, files, out,
            crossval.Settings(seed, {**(shared or {}), **ablation.options}), detector=ablation.variant, tell=tell)
        for reason in dict(result.left_out).values():
            if reason not in reasons:
                tell(f"left out: {reason}")
                reasons.add(reason)
        results[name] = {"group": ablation.group, "what": ablation.title, **summary.summarise(result.scores),
                         "by_height": summary.by_height(result.scores), "folds": [f.plain() for f in result.folds],
                         "seconds": sum(f.seconds for f in result.folds), "left_out": len(result.left_out)}
        if ablation.group == "size":
            results[name]["float"] = summary.summarise(in_float(detector, files, result.folds, out))
    return results


def in_float(detector: Detector, files: Sequence[FlightFile], folds: Sequence[Fold], out: Path) -> list[FlightScore]:
    """Scores of the same folds and models, with the float network as trained; files are the flights of these folds."""
    if not isinstance(detector, InFloat):
        raise AirTouchError("this detector's network does not run in float")
    models: dict[int | str | None, Any] = {fold.fold: detector.load(out / fold.model) for fold in folds}
    float_detector = InFloatOnly(detector)
    readable, _ = crossval.readable_flights(files, evaluate.spare_of(detector), arm_pwm=evaluate.arm_pwm_by(detector))
    return [evaluate.evaluate_flight(f, readable[f.path], float_detector, models[f.condition.fold]).score
            for f in files if f.path in readable]
