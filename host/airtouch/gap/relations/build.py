"""Learn a library from about 25,000 simulated flights, in half an hour of one core.

    python -m airtouch.gap.relations.build OUT.npz [--scenario diagnosis] [--vehicle crazyflie-2.1-flow] [--force]

The flights' seed is no sealed set's (`learning.SEED`), so that the file is the same every time.

Whitened features (F of them) have the covariance 1 in nominal flights. What is stored is their projection on the Q
directions in which effects and nameless disturbances move them.

How many flights it takes and how many directions are stored is in `settings`. The thresholds below were chosen with
the library of 2026-11-24, on flights of `learning.SEED` alone (host/docs/looks.md, 12:43 UTC of that day). What other
values were tried is not recorded.
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from scipy.linalg import solve_triangular

from airtouch.errors import AirTouchError, in_one_line
from airtouch.gap.features.feature_space import Standard, cholesky_factor, directions, standard_of
from airtouch.gap.relations.calibration import calibrated, nominal_distance, two_of
from airtouch.gap.relations.effect_class import KNOT, KNOT_FACTOR, ClassFlights, EffectClass, learn_class, stands_out
from airtouch.gap.relations.hypotheses import FlightHypotheses, LearnedModel
from airtouch.gap.relations.learning import (
    SEED,
    Drawing,
    Progress,
    Scene,
    Stream,
    all_drawings,
    disturbed_flights,
    drawn_flights,
    fly,
    scaled,
    weakest_strength,
)
from airtouch.gap.relations.library import HALF_PRECISION, Coordinates, Library, packed, read, save
from airtouch.gap.relations.settings import SHIPPED, BuildSettings
from airtouch.logs.files import check_free
from airtouch.simulation.effects import Active
from airtouch.vehicle import DEFAULT_VEHICLE, load

#: nominal standard deviations; the direction of a nameless disturbance counts where its shift is longer. A larger
#: number takes directions from fewer flights, with less nominal scatter in them
LEAST_NAMELESS_LENGTH = 3.0
#: nominal standard deviations; two effects show their interaction where the smaller one's shift is longer. A larger
#: number takes the interaction from fewer flights, with less nominal scatter in it
LEAST_PAIR_LENGTH = 12.0


@dataclass(frozen=True)
class Whitening:
    """Standardised features as coordinates (n, F) in which nominal flights have the covariance 1; L L' is theirs."""

    standard: Standard
    lower: np.ndarray

    def __call__(self, features: np.ndarray) -> np.ndarray:
        """Whitened features (n, F) of flights (n, F) or of one flight (F,)."""
        return solve_triangular(self.lower, self.standard(np.atleast_2d(features)).T, lower=True).T


@dataclass(frozen=True)
class PairedFlights:
    """Flights of a class, each beside the nominal flight of the same number.

    amount (n, p): true parameters that vary (`learning.scaled`); shift (n, F): whitened, from the nominal flight;
    whitened (n, F): the flights themselves; strengths: the lowest and the highest that were drawn.
    """

    drawing: Drawing
    amount: np.ndarray
    shift: np.ndarray
    whitened: np.ndarray
    strengths: tuple[float, float]

    def draw_strong(self, rng: np.random.Generator) -> Active:
        """The effect at a strength of the upper half of its range, log-uniform."""
        low, high = np.log(self.strengths)
        return self.drawing.active(float(np.exp(rng.uniform(0.5 * (low + high), high))), rng)


def build(scene: Scene, settings: BuildSettings = SHIPPED, progress: Progress = lambda _: None) -> Library:
    """The library of a scene, learned from flights that are simulated there, and calibrated.

    progress: called with the name of each step.
    """
    progress("nominal flights")
    by_number = {i: f for i in range(settings.nominal_flights) if (f := fly(scene, i)) is not None}
    features = np.array(list(by_number.values()))
    standard = standard_of(features)
    whitening = Whitening(standard, cholesky_factor(standard(features)))
    nominal = dict(zip(by_number, whitening(features), strict=True))
    nominal_mean = np.mean(list(nominal.values()), axis=0)
    drawings, paired = all_drawings(), []
    for number, drawing in enumerate(drawings, 1):
        progress(f"{number} of {len(drawings)}: {drawing.name} {drawing.shape or ''}")
        paired.append(_paired_flights(scene, whitening, nominal, drawing, settings))
    progress("flights with nameless disturbances")
    nameless = np.array([whitening(f.features)[0] - nominal[f.number]
                         for f in disturbed_flights(scene, settings.nameless_flights) if f.number in nominal])
    axes = directions([p.shift for p in paired], settings.directions_of_class, nameless,
                      settings.directions_of_nameless)
    projection = solve_triangular(whitening.lower, axes, lower=True, trans="T").astype(HALF_PRECISION).astype(float)
    axes = whitening.lower.T @ projection  # as they are after the rounding
    classes = tuple(_class_of(p, axes, nominal_mean) for p in paired)
    coordinates = Coordinates(standard, projection, (standard(features) @ projection).mean(axis=0))
    additive = LearnedModel(classes, interaction=np.zeros((projection.shape[1], 0)),
                            nameless=nameless_loadings(nameless @ axes)[:, :settings.rank_of_nameless])
    progress("flights of two effects")
    interaction = _interaction(scene, coordinates, additive, paired, settings.flights_of_two)
    model = replace(additive, interaction=interaction[:, :settings.rank_of_interaction])
    progress("calibration")
    distance = nominal_distance(scene, coordinates.rounded(), settings.calibration.nominal_flights)
    library = Library(scene.scenario, scene.vehicle.name, coordinates, model, distance)
    return calibrated(scene, read(packed(library)), settings.calibration, progress)  # as it will be read, rounded


def _class_of(paired: PairedFlights, axes: np.ndarray, nominal_mean: np.ndarray) -> EffectClass:
    """The class of paired flights in the coordinates along axes (F, Q); nominal_mean (F,): of whitened features.

    Raises AirTouchError where too few of the flights show the effect.
    """
    drawing = paired.drawing
    flights = ClassFlights(paired.amount, paired.shift @ axes, (paired.whitened - nominal_mean) @ axes)
    learned = learn_class(drawing.name, drawing.kind.effect, drawing.shape, flights)
    if learned is None:
        raise AirTouchError(f"too few flights show {drawing.name}: fly more for each knot")
    return learned


def _paired_flights(scene: Scene, whitening: Whitening, nominal: dict[int, np.ndarray], drawing: Drawing,
                    settings: BuildSettings) -> PairedFlights:
    """Flights of one class, from strengths that hardly show to the highest; nominal: whitened (F,) by number."""
    high = drawing.kind.highest
    few = dict(list(nominal.items())[:settings.weakest_flights])
    low = min(weakest_strength(high, partial(_shifts, scene, whitening, few, drawing)), high / KNOT_FACTOR)
    of_direction = 2 if np.count_nonzero(scaled(drawing, drawing.active(high, np.random.default_rng(0)))) > 1 else 1
    count = int(of_direction * settings.flights_per_knot * (np.log(high / low) / KNOT + 1.0))
    flights = [f for f in drawn_flights(scene, drawing, (low, high), count) if f.number in nominal]
    amount = np.array([scaled(drawing, f.active) for f in flights])
    whitened = whitening(np.array([f.features for f in flights]))
    shift = whitened - np.array([nominal[f.number] for f in flights])
    return PairedFlights(drawing, amount[:, np.abs(amount).max(axis=0) > 0.0], shift, whitened, (low, high))


def _shifts(scene: Scene, whitening: Whitening, nominal: dict[int, np.ndarray], drawing: Drawing, strength: float,
            ) -> list[np.ndarray]:
    """Whitened shifts (F,) by a class at a strength, of the flights of these numbers that end well."""
    features = ((i, fly(scene, i, [drawing.active(strength, np.random.default_rng([SEED, Stream.WEAKEST, i]))]))
             for i in nominal)
    return [whitening(f)[0] - nominal[i] for i, f in features if f is not None]


def nameless_loadings(shift: np.ndarray) -> np.ndarray:
    """Directions (Q, r), times the standard deviation, of nameless shifts (n, Q) over their length.

    The direction of the largest one comes first.
    """
    length = np.linalg.norm(shift, axis=1, keepdims=True)
    clear = length[:, 0] > LEAST_NAMELESS_LENGTH
    unit_shift = shift[clear] / length[clear]
    _, deviation, axes = np.linalg.svd(unit_shift / np.sqrt(len(unit_shift)), full_matrices=False)
    return axes.T * deviation


def _interaction(scene: Scene, coordinates: Coordinates, additive: LearnedModel, paired: Sequence[PairedFlights],
                 count: int) -> np.ndarray:
    """Directions (Q, r), times the standard deviation, of what two effects are beside their sum, over the smaller.

    additive: a model in which two effects are their sum; count: of flights with two effects.
    """
    relative, noise = [], []
    for i in range(count):
        rng = np.random.default_rng([SEED, Stream.PAIR, i])
        a, b = two_of([p.drawing for p in paired], rng)
        f = fly(scene, i, [paired[j].draw_strong(rng) for j in (a, b)])
        if f is None:
            continue
        residual, smaller = _residual_of_two(additive, coordinates(f[None])[0], a, b)
        if smaller > LEAST_PAIR_LENGTH:
            noise.append(smaller ** -2.0)
            if np.linalg.norm(residual) < smaller:  # else the strengths found are not the right ones
                relative.append(residual / smaller)
    if not relative:  # no pair shows one
        return np.zeros((coordinates.projection.shape[1], 0))
    return loadings_beyond_noise(np.array(relative), float(np.mean(noise)))


def loadings_beyond_noise(values: np.ndarray, noise: float) -> np.ndarray:
    """Directions (Q, r), times the standard deviation, in which values (n, Q) vary more than noise alone may.

    noise: variance of the noise in each direction. The direction of the largest variance comes first.
    """
    samples, dimensions = values.shape
    _, deviation, axes = np.linalg.svd(values / np.sqrt(samples), full_matrices=False)
    beyond = stands_out(deviation ** 2, noise, dimensions, samples)
    return axes[beyond].T * np.sqrt(deviation[beyond] ** 2 - noise)


def _residual_of_two(model: LearnedModel, values: np.ndarray, a: int, b: int) -> tuple[np.ndarray, float]:
    """What two right classes leave of a flight (Q,), and the length of the smaller one's shift."""
    one, two = model.classes[a], model.classes[b]
    flight = FlightHypotheses(values, model)
    both = flight.with_two(one, two)
    return flight.rescaling(both.fits)(values - both.shift), min(float(np.linalg.norm(f.shift)) for f in both.fits)


def main() -> None:
    """Build a library and write it; refuse before the work what could not be written after it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path, help="file of the library")
    parser.add_argument("--scenario", default="diagnosis", help="what is flown (default %(default)s)")
    parser.add_argument("--vehicle", default=DEFAULT_VEHICLE, help="name or .toml file (default %(default)s)")
    parser.add_argument("--force", action="store_true", help="replace the file")
    options = parser.parse_args()
    check_free(options.out, options.force)
    library = build(Scene(options.scenario, load(options.vehicle)),
                    progress=lambda text: print(text, flush=True))
    save(library, options.out, options.force)
    for c in library.model.classes:
        measured = c.calibration
        print(f"{c.name} {c.shape or ''}: nameless share {measured.nameless_share:.3f}, "
              f"second share {measured.second_share:.3f}, distance scatter {measured.distance_scatter:.3f}")


if __name__ == "__main__":
    with in_one_line("build"):
        main()
