"""Learn a library from simulated flights, about 20,000 of them; takes some 20 min of one core.

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
from airtouch.gap.relations.density import coordinates_of, fit, plain
from airtouch.gap.relations.effect_class import CHANCE, learned
from airtouch.gap.relations.hypotheses import Flown, Learned
from airtouch.gap.relations.learning import SEED, Drawing, Scene, drawings, drawn_flights, fly
from airtouch.gap.relations.library import STORED, Library, packed, read, save
from airtouch.gap.relations.space import Standard
from airtouch.gap.signatures.candidates import alike, free_of, unit
from airtouch.simulation.effects import EFFECTS, NAMES, Active, get
from airtouch.vehicle import load

NOMINAL, NAMELESS, PAIRS, CHECKS, A_CLASS = 5000, 3000, 300, 300, 12  #: flights of each kind; of A_CLASS for each class
PER_KNOT = 60  #: flights of a class for each factor of three in strength, twice as many where it has a direction
FIRST_CHECK, FIRST_OF_CLASS = 1_000_000, 1_100_000  #: numbers of flights that the rest is checked on
SMALL = 6.0  #: size of a shift in all whitened features that is hardly one: such are the weakest flights of a class
HALVINGS = 17  #: of a strength, at most
COMMON, EACH, OF_NAMELESS = 160, 6, 120  #: directions: of nameless disturbances, of each class, of their scatter
TOGETHER = 24  #: directions, at most, in which two effects are no sum
CLEAR = 12.0  #: size of the smaller of two effects from which their sum is looked at
RANGE = 30.0  #: factor of strengths over which classes are checked
KEPT = 0.8  #: share of the flights of a class that keep the shares of their evidence that are stored
LEAST_GAIN = 10.0  #: nats that chance and a crude model may gain beside any class
LOGARITHMIC = frozenset({"motor_lag", "imu_noise", "controller_gain"})  #: effects whose parameters are factors
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
    ways = space.directions([p.shift for p in paired], EACH, nameless, COMMON)
    stored = solve_triangular(white.lower, ways, lower=True, trans="T").astype(STORED).astype(float)
    ways, at = white.lower.T @ stored, standard(table) @ stored
    return _learned(scene, Library(scene.scenario, scene.vehicle.name, standard, stored, at.mean(axis=0),
                                   Learned((), np.zeros((stored.shape[1], 0)), _of_nameless(nameless @ ways)),
                                   (0.0, 1.0), np.zeros(0), np.zeros(0), np.zeros(0)), paired, middle, ways, say)


def _learned(scene: Scene, empty: Library, paired: Sequence[Paired], middle: np.ndarray, ways: np.ndarray, say: Say,
             ) -> Library:
    """The library with classes, and what is known of them by flights that they were not learned from."""
    classes = tuple(learned(p.drawing.name, p.drawing.kind.effect, p.drawing.shape, p.strength, p.shift @ ways,
                            (p.flown - middle) @ ways) for p in paired)
    library = replace(empty, learned=replace(empty.learned, classes=classes))
    say("flights of two effects")
    library = replace(library, learned=replace(library.learned, together=_together(scene, library, paired)))
    say("checks")
    nothing = np.zeros(len(classes))
    return checked(scene, read(packed(replace(library, left=nothing, more=nothing, far=nothing))))


def _paired(scene: Scene, white: Whitened, nominal: dict[int, np.ndarray], drawing: Drawing, say: Say) -> Paired:
    """Flights of one class, from strengths that hardly show to the highest."""
    say(f"{drawing.name} {drawing.shape or ''}")
    high = low = drawing.kind.highest
    for _ in range(HALVINGS):
        if _size(scene, white, nominal, drawing, low) <= SMALL:
            break
        low /= 2.0
    low = min(low, high / 3.0)
    turned = 2 if np.count_nonzero(_scaled(drawing, drawing.active(high, np.random.default_rng(0)))) > 1 else 1
    count = int(turned * PER_KNOT * (np.log(high / low) / np.log(3.0) + 1.0))
    made = [(i, a, f) for i, a, f in drawn_flights(scene, drawing, (low, high), count) if i in nominal]
    strength = np.array([_scaled(drawing, a) for _, a, _ in made])
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


def _scaled(drawing: Drawing, active: Active) -> np.ndarray:
    """Parameters (p,) of an effect in natural steps from neutral; of factors the logarithm."""
    effect = get(drawing.kind.effect)
    alone = drawing.name.partition(" ")[2]  # one of an effect's parameters, where the class is of that one
    free = [p for p in effect.parameters if p.name in free_of(effect) and alone in ("", p.name)]
    if effect.name in LOGARITHMIC:
        return np.array([np.log(active.values[p.name]) for p in free])
    return np.array([(active.values[p.name] - (p.neutral or 0.0)) / unit(p) for p in free])


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
    _, spread, ways = np.linalg.svd(unit_shift / np.sqrt(len(unit_shift)), full_matrices=False)
    return ways[:OF_NAMELESS].T * spread[:OF_NAMELESS]


def _together(scene: Scene, library: Library, paired: Sequence[Paired]) -> np.ndarray:
    """Directions (Q, r), times the deviation, of what two effects are beside their sum, over the smaller."""
    relative, noise = [], []
    for i in range(PAIRS):
        rng = np.random.default_rng([SEED, 97, i])
        while True:
            a, b = (int(j) for j in rng.choice(len(paired), 2, replace=False))
            if not alike(paired[a].drawing.kind.effect, paired[b].drawing.kind.effect):
                break
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
    _, spread, ways = np.linalg.svd(relative / np.sqrt(many), full_matrices=False)
    stands = spread ** 2 > CHANCE * noise * (1.0 + np.sqrt(dimensions / many)) ** 2
    stands[TOGETHER:] = False
    return ways[stands].T * np.sqrt(spread[stands] ** 2 - noise)


def _drawn(paired: Paired, rng: np.random.Generator) -> Active:
    """An effect of a class, not of its weakest strengths."""
    low, high = np.log(paired.range)
    return paired.drawing.active(float(np.exp(rng.uniform(0.5 * (low + high), high))), rng)


def _residual_of_two(library: Library, values: np.ndarray, a: int, b: int) -> tuple[np.ndarray, float]:
    """What two right classes leave of a flight (Q,), and the size of the smaller one's shift."""
    one, two = library.learned.classes[a], library.learned.classes[b]
    first = fit(one, values, plain(len(values)))
    known = coordinates_of(first.factors())
    flown = Flown(values, library.learned)
    both = flown.settled(flown.judged((first, fit(two, known(values - first.shift), known))))
    return flown.coordinates(both.fits)(values - both.shift), min(float(np.linalg.norm(f.shift)) for f in both.fits)


def checked(scene: Scene, library: Library) -> Library:
    """The library with what is known of it by flights that it was not learned from."""
    flown = [f for i in range(CHECKS) if (f := fly(scene, FIRST_CHECK + i)) is not None]
    squared = (library.coordinates(np.array(flown)) ** 2).sum(axis=1)
    low, high = np.quantile(squared, [0.16, 0.84])
    library = replace(library, distance=(float(np.median(squared)), float(0.5 * (high - low))))
    drawing_of = {(d.name, d.shape): d for e in NAMES if e in EFFECTS for d in drawings(e)}
    shares = [_shares(scene, library, i, drawing_of[c.name, c.shape]) for i, c in enumerate(library.learned.classes)]
    left, more, far = np.array(shares).T
    return replace(library, left=left, more=more, far=far)


def _shares(scene: Scene, library: Library, place: int, drawing: Drawing) -> tuple[float, float, float]:
    """`Library.left`, `more` and `far` of a class."""
    own, left, more, far = library.learned.classes[place], [0.0], [0.0], [0.0]
    for i in range(A_CLASS):
        rng = np.random.default_rng([SEED, 96, place, i])
        strength = float(np.exp(rng.uniform(np.log(drawing.kind.highest / RANGE), np.log(drawing.kind.highest))))
        f = fly(scene, FIRST_OF_CLASS + 1000 * place + i, [drawing.active(strength, rng)])
        if f is None:
            continue
        y = library.coordinates(f[None])[0]
        flown, found = Flown(y, library.learned), fit(own, y, plain(len(y)))
        here = flown.judged((found,))
        second = flown.beside(here, lambda c, _: not alike(c.effect, own.effect))[0]
        beyond = library.beyond(flown.distance(here))
        for shares, gain in ((left, flown.nameless(here) - here.evidence - LEAST_GAIN),
                             (more, second.evidence - here.evidence - LEAST_GAIN), (far, beyond - library.usual)):
            shares.append(max(gain, 0.0) / max(here.evidence, LEAST_GAIN))
    return float(np.quantile(left, KEPT)), float(np.quantile(more, KEPT)), float(np.quantile(far, KEPT))


def main() -> None:
    """Build a library and write it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--scenario", default="diagnosis")
    parser.add_argument("--vehicle", default="crazyflie-2.1-flow")
    given = parser.parse_args()
    made = build(Scene(given.scenario, load(given.vehicle)), lambda text: print(text, flush=True))
    save(made, given.out)
    for c, left, more, far in zip(made.learned.classes, made.left, made.more, made.far, strict=True):
        print(f"{c.name} {c.shape or ''}: left {left:.3f}, more {more:.3f}, far {far:.3f}")


if __name__ == "__main__":
    main()
