"""Learn a library from about 25,000 simulated flights, in half an hour of one core.

    python -m airtouch.gap.relations.build OUT.npz [--scenario diagnosis] [--vehicle crazyflie-2.1-flow]

The flights' seed is no sealed set's (`learning.SEED`), so that the file is the same every time.
"""

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.linalg import solve_triangular

from airtouch.gap.relations import exposure, space
from airtouch.gap.relations.checks import checked, two_of
from airtouch.gap.relations.effect_class import CHANCE, learn_class
from airtouch.gap.relations.hypotheses import FlightFeatures, LearnedModel
from airtouch.gap.relations.learning import SEED, Drawing, Scene, drawings, drawn_flights, fly, scaled
from airtouch.gap.relations.library import STORED, Library, packed, read, save
from airtouch.gap.relations.space import Standard
from airtouch.simulation.effects import EFFECTS, NAMES, Active
from airtouch.vehicle import load

NOMINAL, NAMELESS, PAIRS = 5000, 3000, 300  #: flights of each kind
PER_KNOT = 60  #: flights of a class for each factor of three in strength, twice as many where it has a direction
SMALL = 6.0  #: size of a shift in all whitened features that is hardly one: such are the weakest flights of a class
HALVINGS = 17  #: of a strength, at most
COMMON, EACH, OF_NAMELESS = 160, 6, 120  #: directions: of nameless disturbances, of each class, of their scatter
TOGETHER = 24  #: directions, at most, in which two effects are no sum
CLEAR = 12.0  #: size of the smaller of two effects from which their sum is looked at
Say = Callable[[str], None]


@dataclass(frozen=True)
class Whitened:
    """Features as coordinates in which nominal flights have the covariance 1 (lower triangle L of what it is else)."""

    standard: Standard
    lower: np.ndarray

    def __call__(self, features: np.ndarray) -> np.ndarray:
        return solve_triangular(self.lower, self.standard(np.atleast_2d(features)).T, lower=True).T


@dataclass(frozen=True)
class Paired:
    """Flights of a class: scaled parameters (n, p), whitened shifts from the same flights without (n, F), flights."""

    drawing: Drawing
    strength: np.ndarray
    shift: np.ndarray
    flown: np.ndarray
    range: tuple[float, float]


def build(scene: Scene, say: Say = lambda _: None) -> Library:
    """Fly and learn."""
    say("nominal flights")
    nominal = {i: f for i in range(NOMINAL) if (f := fly(scene, i)) is not None}
    table = np.array(list(nominal.values()))
    standard = space.standard_of(table)
    white = Whitened(standard, space.whitening(standard(table)))
    own = dict(zip(nominal, white(table), strict=True))
    middle = np.mean(list(own.values()), axis=0)
    paired = [_paired(scene, white, own, d, say) for e in NAMES if e in EFFECTS for d in drawings(e)]
    say("flights without a name")
    nameless = _nameless(scene, white, own)
    axes = space.directions([p.shift for p in paired], EACH, nameless, COMMON)
    stored = solve_triangular(white.lower, axes, lower=True, trans="T").astype(STORED).astype(float)
    axes, at = white.lower.T @ stored, standard(table) @ stored
    return _learned(scene, Library(scene.scenario, scene.vehicle.name, standard, stored, at.mean(axis=0),
                                   LearnedModel((), np.zeros((stored.shape[1], 0)), _of_nameless(nameless @ axes)),
                                   (0.0, 1.0), np.zeros(0), np.zeros(0), np.zeros(0), 0.0), paired, middle, axes, say)


def _learned(scene: Scene, empty: Library, paired: Sequence[Paired], middle: np.ndarray, axes: np.ndarray, say: Say,
             ) -> Library:
    """The library with classes, and what is known of them by flights that they were not learned from."""
    classes = tuple(learn_class(p.drawing.name, p.drawing.kind.effect, p.drawing.shape, p.strength, p.shift @ axes,
                            (p.flown - middle) @ axes) for p in paired)
    library = replace(empty, model=replace(empty.model, classes=classes))
    say("flights of two effects")
    library = replace(library, model=replace(library.model, interaction=_interaction(scene, library, paired)))
    say("checks")
    nothing = np.zeros(len(classes))
    return checked(scene, read(packed(replace(library, nameless_share=nothing, second_share=nothing,
                                               distance_scatter=nothing))), say)


def _paired(scene: Scene, white: Whitened, nominal: dict[int, np.ndarray], drawing: Drawing, say: Say) -> Paired:
    """Flights of one class, from strengths that hardly show to the highest."""
    say(f"{drawing.name} {drawing.shape or ''}")
    high = low = drawing.kind.highest
    for _ in range(HALVINGS):
        if _size(scene, white, nominal, drawing, low) <= SMALL:
            break
        low /= 2.0
    low = min(low, high / 3.0)
    turned = 2 if np.count_nonzero(scaled(drawing, drawing.active(high, np.random.default_rng(0)))) > 1 else 1
    count = int(turned * PER_KNOT * (np.log(high / low) / np.log(3.0) + 1.0))
    made = [(i, a, f) for i, a, f in drawn_flights(scene, drawing, (low, high), count) if i in nominal]
    strength = np.array([scaled(drawing, a) for _, a, _ in made])
    flown = white(np.array([f for *_, f in made]))
    shift = flown - np.array([nominal[i] for i, *_ in made])
    return Paired(drawing, strength[:, np.abs(strength).max(axis=0) > 0.0], shift, flown, (low, high))


def _size(scene: Scene, white: Whitened, nominal: dict[int, np.ndarray], drawing: Drawing, strength: float) -> float:
    """Median size of the shift by a class at a strength, of three flights."""
    sizes = []
    for i in list(nominal)[:3]:
        f = fly(scene, i, [drawing.active(strength, np.random.default_rng([SEED, 5, i]))])
        sizes += [] if f is None else [np.linalg.norm(white(f)[0] - nominal[i])]
    return float(np.median(sizes)) if sizes else np.inf


def _nameless(scene: Scene, white: Whitened, nominal: dict[int, np.ndarray]) -> np.ndarray:
    """Whitened shifts (n, F) of flights in which something acts that has no name."""
    out = []
    for i in range(NAMELESS):
        f = fly(scene, i, exposure.draw(np.random.default_rng([SEED, i, 1])))
        if f is not None and i in nominal:
            out.append(white(f)[0] - nominal[i])
    return np.array(out)


def _of_nameless(shift: np.ndarray) -> np.ndarray:
    """Directions (Q, r), times the deviation, of nameless shifts (n, Q) over their size."""
    size = np.linalg.norm(shift, axis=1, keepdims=True)
    unit_shift = (shift / np.maximum(size, 1e-9))[size[:, 0] > 3.0]
    _, spread, axes = np.linalg.svd(unit_shift / np.sqrt(len(unit_shift)), full_matrices=False)
    return axes[:OF_NAMELESS].T * spread[:OF_NAMELESS]


def _interaction(scene: Scene, library: Library, paired: Sequence[Paired]) -> np.ndarray:
    """Directions (Q, r), times the deviation, of what two effects are beside their sum, over the smaller."""
    relative, noise = [], []
    for i in range(PAIRS):
        rng = np.random.default_rng([SEED, 97, i])
        a, b = two_of([p.drawing for p in paired], rng)
        f = fly(scene, i, [_drawn(paired[j], rng) for j in (a, b)])
        if f is None:
            continue
        residual, smaller = _residual_of_two(library, library.coordinates(f[None])[0], a, b)
        if smaller > CLEAR:
            noise.append(smaller ** -2.0)
            if np.linalg.norm(residual) < smaller:  # else the strengths found are not the right ones
                relative.append(residual / smaller)
    return _standing_out(np.array(relative), float(np.mean(noise)))


def _standing_out(relative: np.ndarray, noise: float) -> np.ndarray:
    """Directions (Q, r), times the deviation, in which values (n, Q) vary by more than a noise of this variance may."""
    many, dimensions = relative.shape
    _, spread, axes = np.linalg.svd(relative / np.sqrt(many), full_matrices=False)
    stands = spread ** 2 > CHANCE * noise * (1.0 + np.sqrt(dimensions / many)) ** 2
    stands[TOGETHER:] = False
    return axes[stands].T * np.sqrt(spread[stands] ** 2 - noise)


def _drawn(paired: Paired, rng: np.random.Generator) -> Active:
    """An effect of a class, not of its weakest strengths."""
    low, high = np.log(paired.range)
    return paired.drawing.active(float(np.exp(rng.uniform(0.5 * (low + high), high))), rng)


def _residual_of_two(library: Library, values: np.ndarray, a: int, b: int) -> tuple[np.ndarray, float]:
    """What two right classes leave of a flight (Q,), and the size of the smaller one's shift."""
    one, two = library.model.classes[a], library.model.classes[b]
    flown = FlightFeatures(values, library.model)
    both = flown.with_two(one, two)
    return flown.coordinates(both.fits)(values - both.shift), min(float(np.linalg.norm(f.shift)) for f in both.fits)


def main() -> None:
    """Build a library and write it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--scenario", default="diagnosis")
    parser.add_argument("--vehicle", default="crazyflie-2.1-flow")
    given = parser.parse_args()
    made = build(Scene(given.scenario, load(given.vehicle)), lambda text: print(text, flush=True))
    save(made, given.out)
    for c, left, more, far in zip(made.model.classes, made.nameless_share, made.second_share, made.distance_scatter,
                                    strict=True):
        print(f"{c.name} {c.shape or ''}: left {left:.3f}, more {more:.3f}, far {far:.3f}")


if __name__ == "__main__":
    main()
