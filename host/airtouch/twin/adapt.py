"""A detector for the drone of given flights, trained on simulated flights of its twin and on the flights themselves.

Edges in the down range are the labels. Flights without down range get the edges that a detector reports
(pseudo-labels): the one trained on the labelled flights, else the twin's. Expected errors are measured on held-out
flights.
"""

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from airtouch.detector import best
from airtouch.detector.best.model import BestModel
from airtouch.detector.evaluation import evaluate, summary
from airtouch.detector.evaluation.data import simulated
from airtouch.detector.evaluation.data.dataset import FlightFile
from airtouch.detector.evaluation.score import FlightScore
from airtouch.detector.shared import sensors
from airtouch.detector.shared.training_set import flight_hash
from airtouch.logs.edges import Edge
from airtouch.logs.files import make_folder
from airtouch.logs.flight_log import FlightLog
from airtouch.simulation.scenario import Scenario, draw_flight
from airtouch.twin import cache, edge_strength, overlay
from airtouch.vehicle import Vehicle

#: flights of the twin to train on; compared with 150 on both halves of the authors' flights
#: (host/docs/twin-findings.md, longer training)
TWIN_FLIGHTS = 450
#: optimiser steps of a training from given and from random weights. 2500 was compared with 1000 and 5000 on both halves
#: (host/docs/twin-findings.md, longer training); no source for 400: round number, above the 300 of fine-tuning
STEPS = {"shipped": 400, "scratch": 2500}
#: Augmentation of recorded and simulated flights together from random weights: twice the recipe's, as few flights are
#: repeated often; three times is worse. Given weights forget more by it (host/docs/twin-findings.md, longer training).
AUGMENTATION: dict[str, Any] = {"gain": 0.3, "warp": 0.15, "noise": 0.1, "offset": 0.2, "yaw_deg": 40.0}
#: rounds in which flights without labels are labelled, each by the detector of the round before; compared with one on
#: both halves (host/docs/twin-findings.md, a second round of labels)
ROUNDS = 2
FOLDS = 4  #: folds of the cross-validation over labelled flights; no source: round number, for time
STAGE_VERSION = 6  #: version of what the stages do; stored results of another version are not used
MIN_LABELLED = 4  #: least number of labelled flights for a hold-out: one for each fold
#: Decoder of a detector that has been trained on simulated edges: its entry logit hardly rises over high platforms, so
#: that the "over" logit has a large share, smoothed over 0.1 s. Chosen on folds 0 to 2 out of 220, for the least cost
#: of error, misses and false edges over eight detectors of folds 3 and 4, and rounded (host/docs/looks.md).
DECODER = replace(best.DECODER, over_share=0.7, entry_score=3.2, exit_score=-0.2, late_entry=2.0, late_exit=-1.7,
                  smooth_gain=0.2, dwell_steps=30)
#: progress(stage, done, total, note)
Progress = Callable[[str, int, int, str], None]


@dataclass(frozen=True)
class LoadedFlight:
    """A log and the condition (speed, fold) of its file."""

    file: FlightFile
    log: FlightLog

    @property
    def labelled(self) -> bool:
        """True if its down range shows edges."""
        return bool(evaluate.truth(self.log))


@dataclass(frozen=True)
class SimulatedFlights:
    """Flights to train on beside recorded ones: logs, and the edges of each; None if its own down range shows them."""

    logs: list[FlightLog]
    edges: list[list[Edge] | None]


@dataclass(frozen=True)
class Adapted:
    """The model, and scores of held-out flights after training on the other folds and on half of them.

    Both are empty without a hold-out. Only the labels are held out: twin, strengths of edges and free air come from
    all labelled flights, and are in every training. twin_only: scores of all labelled flights by the detector that was
    trained on the simulated flights alone, so also on these flights' free air and strengths. left_out: (file, reason)
    of flights that could not be used. `plain()` says all of it in figures.
    """

    model: BestModel
    held_out: list[FlightScore]
    held_out_half: list[FlightScore]
    twin_only: list[FlightScore]
    left_out: list[tuple[str, str]] = field(default_factory=list)

    def plain(self) -> dict[str, Any]:
        """What was done: the twin, flights labelled, pseudo-labelled and left out, and the errors to expect.

        Each of `twin_only`, `held_out_half` and `held_out` has the figures of `airtouch evaluate --json`, or is None
        where nothing was scored.
        """
        scores = {name: getattr(self, name) for name in ("twin_only", "held_out_half", "held_out")}
        return {**self.model.metadata.get("adapted", {}), "left_out": [list(pair) for pair in self.left_out],
                **{name: summary.summarise(of_flights) if of_flights else None for name, of_flights in scores.items()}}

    def __repr__(self) -> str:
        training = self.model.metadata.get("adapted", {})
        return (f"Adapted({training.get('labelled')} flights labelled by their down range, "
                f"{training.get('pseudo_labelled')} by the detector, {len(self.left_out)} left out; plain() says more)")


def adapt(flights: Sequence[LoadedFlight], scene: Scenario, vehicle: Vehicle, work: Path, *,
          start: BestModel | None, seed: int = 0, hold_out: bool = True, withhold: bool = False,
          progress: Progress | None = None, command: str = "airtouch adapt") -> Adapted:
    """Train a detector on flights and their twin. The same arguments give the same bits.

    start: weights to start from, None for random ones. work: folder for finished stages, so that the same call
    continues after a stop. withhold: use all flights in the last stage as if they had no down range, to measure the
    benefit of unlabelled ones. A sensor that all flights lack is removed from the simulated ones too. Raises
    AirTouchError if no flight crosses an edge.
    """
    make_folder(work)
    absent = absent_sensors(flights)
    start = start.serving(absent) if start else None
    key = _key(flights, scene, vehicle, start, seed)
    twin_flights, origin = simulated_flights(flights, scene, vehicle, seed, progress, work)
    twin_flights = replace(twin_flights, logs=[sensors.without(log, absent) for log in twin_flights.logs])
    labelled = [f for f in flights if f.labelled]
    trainer = Trainer(start, twin_flights, seed, command)
    twin = cache.model(work / f"twin_{key}.npz",
                       partial(trainer.fit_simulated, labelled, _with_name(progress, "twin")))
    twin_only = cache.scores(work / f"twin_{key}.json", partial(score_flights, labelled, twin))
    held_out, held_out_half = [], []
    if hold_out and len(labelled) >= MIN_LABELLED:
        held_out, held_out_half = held_out_scores(trainer, twin, flights, work, key, progress)
    train = [without_range(f) for f in flights] if withhold else flights
    model = cache.model(work / f"{'unlabelled' if withhold else 'all'}_{key}.npz",
                        partial(trainer.fit_all, twin, train, _with_name(progress, "all flights")))
    count = sum(f.labelled for f in train)
    training = {"twin": origin, "labelled": count, "pseudo_labelled": len(flights) - count}
    return Adapted(replace(model, metadata={**model.metadata, "adapted": training}), held_out, held_out_half, twin_only)


def absent_sensors(flights: Sequence[LoadedFlight]) -> tuple[str, ...]:
    """The sensors that all of the flights lack."""
    return tuple(s for s in sensors.SENSORS if all(s in sensors.missing_sensors(f.log) for f in flights))


def simulated_flights(flights: Sequence[LoadedFlight], scene: Scenario, vehicle: Vehicle, seed: int,
                      progress: Progress | None, work: Path | None = None) -> tuple[SimulatedFlights, dict[str, Any]]:
    """Flights of the twin, added to the recorded flights' free air if there is any, and a description for metadata.

    work: folder in which simulated edges are stored, so that the same call continues after a stop. Raises
    AirTouchError if too many simulated flights diverge.
    """
    air = overlay.free_air([f.log for f in flights if f.labelled])
    if not air:
        twin_logs, description = simulated.training_flights(TWIN_FLIGHTS, scene, vehicle=vehicle, seed=seed,
                                                            progress=progress)
        return SimulatedFlights(twin_logs, [None] * len(twin_logs)), description
    report = (lambda done, total: progress("simulated edges", done, total, "")) if progress else (lambda *_: None)
    settings = (STAGE_VERSION, scene.table, vehicle, _equations(scene, vehicle), seed)
    digest = hashlib.sha256(repr(settings).encode()).hexdigest()[:12]
    responses = overlay.simulate_responses(scene, vehicle, TWIN_FLIGHTS, seed, report,
                                           work / f"edges_{digest}" if work else None)
    factors = edge_strength.strengths([f.log for f in flights if f.labelled], responses)
    scaled = [edge_strength.scale(r, factors) for r in edge_strength.balance_heights(responses)]
    twin_logs, edges = overlay.flights(air, scaled, seed)
    description = {"scenario": scene.name, "flights": len(twin_logs), "seed": seed, "free_air_of": len(air),
                   "strengths": {" ".join(key): round(value, 2) for key, value in factors.items()}}
    return SimulatedFlights(twin_logs, list(edges)), description


@dataclass(frozen=True)
class Trainer:
    """Trains detectors on recorded flights and simulated ones beside them; all its trainings share these settings.

    start: weights to start from, None for random ones. simulated: flights to train on beside recorded ones. command:
    noted in the models. The methods' progress is as in `adapt`.
    """

    start: BestModel | None
    simulated: SimulatedFlights
    seed: int
    command: str

    def fit_simulated(self, lag_of: Sequence[LoadedFlight], progress: Progress | None = None) -> BestModel:
        """A detector trained on the simulated flights alone, with its lag on the recorded flights `lag_of`."""
        return best.fit(self.simulated.logs, self.seed, start=self.start, pseudo_labels=self.simulated.edges,
                        lag_of=([f.log for f in lag_of], [None] * len(lag_of)), progress=progress, **self._settings())

    def fit(self, labelled: Sequence[LoadedFlight], pupils: Sequence[LoadedFlight] = (),
            pseudo_edges: Sequence[list[Edge] | None] = (), progress: Progress | None = None) -> BestModel:
        """One training on labelled flights, flights `pupils` with pseudo-labels, and simulated ones, of equal weight.

        Without `start` the recorded and simulated flights are augmented more (AUGMENTATION). The lag is that of the
        recorded ones: recorded edges are detected later than simulated ones.
        """
        count = len(self.simulated.logs)
        recorded, labels = [f.log for f in (*labelled, *pupils)], [*[None] * len(labelled), *pseudo_edges]
        weights = [count / len(group) for group in (labelled, pupils) for _ in group] + [1.0] * count
        return best.fit([*recorded, *self.simulated.logs], self.seed, start=self.start,
                        pseudo_labels=[*labels, *self.simulated.edges], emphasis=weights, lag_of=(recorded, labels),
                        progress=progress, **self._settings(), **({} if self.start else AUGMENTATION))

    def self_train(self, teacher: BestModel, labelled: Sequence[LoadedFlight], unlabelled: Sequence[LoadedFlight],
                   progress: Progress | None = None) -> BestModel:
        """A detector trained on labelled flights, flights that the teacher labels, and simulated ones.

        Flights in which the teacher sees no platform, or not both edges of each, are left out: they may be over one
        that it missed. The teacher itself where no flight remains. In each of ROUNDS the detector of the round before
        is the teacher.
        """
        for _ in range(ROUNDS):
            labels = best.pseudo_labels([f.log for f in unlabelled], teacher)
            complete = [(f, edges) for f, edges in zip(unlabelled, labels, strict=True)
                        if edges and [e.kind for e in edges] == ["entry", "exit"] * (len(edges) // 2)]
            if not complete:
                break
            pupils, pseudo_edges = zip(*complete, strict=True)
            teacher = self.fit(labelled, pupils, pseudo_edges, progress)
        return teacher

    def fit_all(self, twin: BestModel, flights: Sequence[LoadedFlight], progress: Progress | None = None) -> BestModel:
        """A detector trained on flights with and without labels and on simulated ones; `twin` itself without flights.

        It is trained from `start` on both kinds, each with half of the crops: a network that is trained further on a
        few labelled flights alone forgets the edges that those lack. Flights without labels are then labelled by it,
        or by `twin`, the detector of simulated flights, where no flight is labelled.
        """
        labelled = [f for f in flights if f.labelled]
        unlabelled = [f for f in flights if not f.labelled]
        teacher = self.fit(labelled, progress=progress) if labelled else twin
        return self.self_train(teacher, labelled, unlabelled, progress)

    def _settings(self) -> dict[str, Any]:
        """Options of `best.fit` that depend on where the weights come from."""
        return {"decoder": None if self.start else DECODER, "steps": STEPS["shipped" if self.start else "scratch"],
                "command": self.command}


def held_out_scores(trainer: Trainer, twin: BestModel, flights: Sequence[LoadedFlight], work: Path, key: str,
                    progress: Progress | None = None) -> tuple[list[FlightScore], list[FlightScore]]:
    """Scores of the labelled flights by cross-validation: trained on all other folds, and on half of their flights.

    The labelled flights are assigned to FOLDS folds by seed; those without labels are in every training, as are the
    simulated flights, which hold the free air and the strengths of edges of the flights held out. Models and scores
    are stored in `work` under `key`.
    """
    labelled = [f for f in flights if f.labelled]
    unlabelled = [f for f in flights if not f.labelled]
    order = np.random.default_rng([trainer.seed, 7]).permutation(len(labelled))
    folds = min(FOLDS, len(labelled))
    scores: list[FlightScore] = []
    scores_half: list[FlightScore] = []
    for k in range(folds):
        test = [labelled[i] for i in order[k::folds]]
        train = [labelled[i] for j, i in enumerate(order) if j % folds != k]
        for divisor, results in ((1, scores), (2, scores_half)):
            subset = train[:max(len(train) // divisor, 1)]
            path = work / f"fold{k}_{divisor}_{key}"
            name = f"hold-out {k + 1}/{folds}" + (" (half)" if divisor == 2 else "")
            model = cache.model(path.with_suffix(".npz"), partial(
                trainer.fit_all, twin, [*subset, *unlabelled], _with_name(progress, name)))
            results += cache.scores(path.with_suffix(".json"), partial(score_flights, test, model))
    return scores, scores_half


def without_range(flight: LoadedFlight) -> LoadedFlight:
    """The flight without its down range."""
    log = flight.log
    return replace(flight, log=FlightLog({k: v for k, v in log.columns.items() if k != "zrange_m"}, log.meta))


def score_flights(flights: Sequence[LoadedFlight], model: BestModel) -> list[FlightScore]:
    """The flights' scores by a model."""
    return [evaluate.evaluate_flight(f.file, f.log, best, model).score for f in flights]


def _with_name(progress: Progress | None, name: str) -> Progress | None:
    """The progress with a name before each stage."""
    if progress is None:
        return None
    return lambda stage, done, total, note: progress(f"{name}: {stage}", done, total, note)


def _equations(scene: Scenario, vehicle: Vehicle) -> str:
    """`cache.equations` of the vehicle as the scenario's flights have it."""
    return cache.equations(draw_flight(scene, 0, 0).with_changes(vehicle))


def _key(flights: Sequence[LoadedFlight], scene: Scenario, vehicle: Vehicle, start: BestModel | None, seed: int) -> str:
    """Hash of everything that the result depends on."""
    settings = (STAGE_VERSION, scene.table, vehicle, _equations(scene, vehicle), seed, TWIN_FLIGHTS, STEPS,
                AUGMENTATION, ROUNDS, DECODER, *edge_strength.BOUNDS)
    digest = hashlib.sha256(repr(settings).encode())
    for flight in flights:
        digest.update(f"{flight_hash(flight.log)} {flight.labelled} {flight.file.condition}".encode())
    if start is not None:
        for name in sorted(start.weights):
            digest.update(np.asarray(start.weights[name]).tobytes())
    return digest.hexdigest()[:12]
