"""What a training of `best` may be told beside its flights and its seed."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from airtouch import logs
from airtouch.detector.best.model import BestModel
from airtouch.detector.best.recipe import Recipe
from airtouch.detector.shared import sensors
from airtouch.errors import AirTouchError
from airtouch.logs.flight_log import FlightLog
from airtouch.reference.edge_decoder import DecoderConfig

#: The fields of a recipe that differ where training goes on from a model: fewer steps, at a quarter of the rate of a
#: full training. Chosen; what ten labelled flights gain with them is in host/docs/results.md.
FINE_TUNING: dict[str, Any] = {"steps": 300, "peak_rate": 1e-3}

#: progress(stage, done, total, note), stage "features" (flights) or "steps"
Progress = Callable[[str, int, int, str], None]
#: The true edges of each flight; None where its down range shows them
Labels = Sequence[Sequence[logs.Edge] | None]
#: Flights and their labels, one entry a flight
Labelled = tuple[Sequence[FlightLog], Labels]


@dataclass(frozen=True)
class FitSettings:
    """Settings of `fitting.fit`; the defaults train a full model on flights that label themselves.

    Examples:
        pseudo_labels: labels, one entry a flight (`fitting.pseudo_labels` makes them); None where the down range of
            every flight shows its edges.
        emphasis: how often each flight is drawn against the others, one number a flight; None for all alike.
        most_flights: train on so many at most, drawn by the seed; None for all.
        free_air: flights without edges (`free_air.read`), to learn silence from; none by default.
    Network:
        recipe: its shape and training; None for `Recipe()`, or for that of `start` with FINE_TUNING.
        start: a model to go on from: the same network, and its zeros stay; None for random weights.
        decoder: the decoder's settings; None for those of `start`, or for `detector.DECODER`.
        lag_of: flights whose lag counts before that of the training flights (`fitting.with_lag`); None for these.
    The run:
        progress: called as the training goes; None for silence.
        command: what the model's metadata names as its origin.
        work: a folder in which the training is kept, so that the same call goes on after a stop; None for no folder.
    """

    pseudo_labels: Labels | None = None
    emphasis: Sequence[float] | None = None
    most_flights: int | None = None
    free_air: Sequence[FlightLog] = ()
    recipe: Recipe | None = None
    start: BestModel | None = None
    decoder: DecoderConfig | None = None
    lag_of: Labelled | None = None
    progress: Progress | None = None
    command: str = "airtouch.detector.best.fit"
    work: Path | None = None

    def resolved(self, changes: dict[str, Any]) -> tuple["FitSettings", Recipe]:
        """(these settings with the changes, the recipe to train by).

        changes: fields of this record, or of its recipe, by name.
        Raises AirTouchError for an unknown name, and for a recipe of another shape than that of `start`.
        """
        own = {field.name for field in fields(self)}
        settings = replace(self, **{name: value for name, value in changes.items() if name in own})
        recipe, start = settings.recipe, settings.start
        if recipe is None:
            recipe = replace(start.recipe, **FINE_TUNING) if start else Recipe()
        of_recipe = {name: value for name, value in changes.items() if name not in own}
        absent = of_recipe.keys() - asdict(recipe).keys()
        if absent:
            known = ", ".join([*asdict(recipe), *sorted(own)])
            raise AirTouchError(f"training: no setting {min(absent)!r}; known: {known}")
        recipe = replace(recipe, **of_recipe)
        if start is not None and start.recipe.graph != recipe.graph:
            raise AirTouchError("training: the model to start from has another shape; leave width, taps and dilations "
                                "alone")
        return settings, recipe


@dataclass(frozen=True)
class Examples:
    """The flights that a training sees, with one label and, unless all count alike, one weight each."""

    flights: Sequence[FlightLog]
    labels: Labels
    emphasis: Sequence[float] | None

    @classmethod
    def drawn(cls, flights: Sequence[FlightLog], settings: FitSettings, seed: int) -> "Examples":
        """The flights, or `most_flights` of them. Raises AirTouchError unless there is one pseudo-label a flight."""
        labels = [None] * len(flights) if settings.pseudo_labels is None else list(settings.pseudo_labels)
        if len(labels) != len(flights):
            raise AirTouchError(f"training: {len(labels)} pseudo-labels for {len(flights)} flights; give one a flight")
        emphasis, most = settings.emphasis, settings.most_flights
        if most is None or most >= len(flights):
            return cls(flights, labels, emphasis)
        drawn = sorted(np.random.default_rng(seed).permutation(len(flights))[:most])
        return cls([flights[i] for i in drawn], [labels[i] for i in drawn],
                   None if emphasis is None else [emphasis[i] for i in drawn])

    def muted(self, recipe: Recipe) -> Recipe:
        """The recipe with the channels of a sensor that no flight has held at 0 for good."""
        return replace(recipe, muted=tuple(sorted({*recipe.muted, *sensors.silent_in_all(self.flights)})))
