"""What may have changed a hover: each hypothesis with samples of its prior, and the change of balance that they make.

A rotor that lost thrust needs a higher command by itself, which shows in lift, roll, pitch and
yaw alike. A weight raises the lift and, off centre, moves commands between opposite rotors and
leaves yaw as it is.
"""

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.special import ndtri

from airtouch.gap.balance.priors import PRIOR_PROBABILITY, PRIORS, STEADY, PowerChange, Priors
from airtouch.gap.loop.command_spectra import MIX
from airtouch.vehicle import Vehicle

SAMPLES = 4096  #: of each prior; a power of two, as a Sobol sequence needs; chosen
SEED, UNKNOWN_SEED = 1, 2  #: of the Sobol sequences
MOST_LOSS = 0.8  #: fraction of thrust that a rotor loses at most; chosen
QUANTILES = (1e-6, 1.0 - 1e-6)  #: of a normal distribution between which samples lie, so that all are finite
ROTORS = range(4)
Effect = tuple[str, dict[str, np.ndarray]]  #: name, and samples (SAMPLES,) of each parameter


@dataclass(frozen=True)
class Hypothesis:
    """Effects with parameters drawn from the prior (samples,), and their change (samples, 4) of the balance."""

    name: str  #: in the answer
    prior: float  #: probability
    effects: tuple[Effect, ...]
    change: np.ndarray
    power_change: PowerChange
    after_maintenance: bool = True  #: whether there was maintenance since the nominal flights


@dataclass(frozen=True)
class Samples:
    """Samples that all hypotheses share.

    normal (SAMPLES, 3): of the standard normal distribution; x, y (SAMPLES,): places of a weight, m from the centre,
    even over a disc; half_side: from the centre to a rotor along x or y, m.
    """

    normal: np.ndarray
    x: np.ndarray
    y: np.ndarray
    half_side: float


def hypotheses(vehicle: Vehicle, priors: Priors = PRIORS, without: Collection[str] = ()) -> list[Hypothesis]:
    """No effect, one or two weak rotors, a weight at its place, a weight on a thread, something else.

    without: names that are no candidates. Without com_offset a weight on board stays one, at the centre of mass.
    """
    samples = samples_of(vehicle, priors)
    weight = weight_on_board(samples, priors)
    if "com_offset" in without:
        centred = weight_on_board(replace(samples, x=np.zeros(SAMPLES), y=np.zeros(SAMPLES)), priors)
        weight = replace(centred, effects=centred.effects[:1])
    candidates = [*no_effect(), *weak_rotors(samples, priors), weight,
                  weight_on_thread(samples, priors, vehicle.mass_kg), moved_centre(samples, priors),
                  *nameless_changes(priors)]
    return [h for h in candidates if h.name not in without]


def samples_of(vehicle: Vehicle, priors: Priors) -> Samples:
    """The shared samples for a vehicle."""
    from scipy.stats import qmc  # slow to import, and seldom needed

    uniform = qmc.Sobol(3, seed=SEED).random(SAMPLES)
    reach, angle = priors.reach * vehicle.arm_m * np.sqrt(uniform[:, 1]), 2.0 * np.pi * uniform[:, 2]
    return Samples(ndtri(np.clip(uniform, *QUANTILES)), reach * np.cos(angle), reach * np.sin(angle),
                   vehicle.arm_m / np.sqrt(2.0))


def no_effect() -> list[Hypothesis]:
    """The vehicle as it was, and after maintenance: as probable."""
    return [Hypothesis("none", PRIOR_PROBABILITY["none"] / 2, (), np.zeros((1, 4)), STEADY, after_maintenance)
            for after_maintenance in (False, True)]


def weak_rotors(samples: Samples, priors: Priors) -> list[Hypothesis]:
    """Each of the four rotors alone, and each of their six pairs, as probable as one another."""
    one, two = PRIOR_PROBABILITY["one weak rotor"] / 4, PRIOR_PROBABILITY["two weak rotors"] / 6
    loss = np.minimum(priors.thrust_loss * np.abs(samples.normal), MOST_LOSS)
    out = []
    for second in ROTORS:
        out.append(_weak_motors(loss, (second,), one, priors))
        out += [_weak_motors(loss, (first, second), two, priors) for first in range(second)]
    return out


def weight_on_board(samples: Samples, priors: Priors) -> Hypothesis:
    """A weight at its place, which moves the centre of mass as well."""
    fraction = priors.added_mass * np.abs(samples.normal[:, 0])
    part = fraction / (1.0 + fraction)
    effects: tuple[Effect, ...] = (("mass", {"fraction": fraction}),
                                   ("com_offset", {"x": part * samples.x, "y": part * samples.y}))
    return Hypothesis("mass", PRIOR_PROBABILITY["mass"], effects, _of_weight(fraction, samples), STEADY)


def weight_on_thread(samples: Samples, priors: Priors, mass_kg: float) -> Hypothesis:
    """A weight on a thread; its parameters are the load (kg) and where the thread is tied (m)."""
    fraction = priors.slung_mass * np.abs(samples.normal[:, 0])
    effect = "slung_load", {"load": fraction * mass_kg, "x": samples.x, "y": samples.y}
    return Hypothesis("slung_load", PRIOR_PROBABILITY["slung_load"], (effect,), _of_weight(fraction, samples), STEADY)


def moved_centre(samples: Samples, priors: Priors) -> Hypothesis:
    """A centre of mass that moved, with the mass as it was."""
    shift, nothing = priors.shift_m * samples.normal[:, :2], np.zeros(SAMPLES)
    change = np.column_stack([nothing, shift[:, 1] / samples.half_side, -shift[:, 0] / samples.half_side, nothing])
    effect = "com_offset", {"x": shift[:, 0], "y": shift[:, 1]}
    return Hypothesis("com_offset", PRIOR_PROBABILITY["com_offset"], (effect,), change, STEADY)


def nameless_changes(priors: Priors) -> list[Hypothesis]:
    """Something that changes all four numbers of the balance, each by itself, or lift or yaw alone: as probable.

    Nothing with a name changes yaw alone, or makes lift alone less. Lift alone more is a weight at the centre of mass,
    roll or pitch alone a centre of mass that moved.
    """
    from scipy.stats import qmc  # slow to import, and seldom needed

    change = priors.unknown * ndtri(np.clip(qmc.Sobol(4, seed=UNKNOWN_SEED).random(SAMPLES), *QUANTILES))
    lift, _, _, yaw = np.eye(4)
    changes = [change, -np.abs(change) * lift, change * yaw]
    return [Hypothesis("unknown", PRIOR_PROBABILITY["unknown"] / len(changes), (("unknown", {}),), c, priors.damaged)
            for c in changes]


def commanded_change(thrust: np.ndarray) -> np.ndarray:
    """Change (n, 4) of the balance by commanded thrusts of the rotors (n, 4), each over its nominal one."""
    mixed = thrust @ MIX.T
    return np.column_stack([np.log(mixed[:, 0]), mixed[:, 1:] / mixed[:, :1]])


def weight_change(fraction: np.ndarray, x: np.ndarray, y: np.ndarray, half_side: float) -> np.ndarray:
    """Change (n, 4) of the balance by a weight of this fraction (n,) of the mass at x, y (n,), m."""
    part = fraction / (1.0 + fraction)
    return np.column_stack([np.log1p(fraction), part * y / half_side, -part * x / half_side, np.zeros(len(fraction))])


def _weak_motors(loss: np.ndarray, rotors: tuple[int, ...], prior: float, priors: Priors) -> Hypothesis:
    """The hypothesis of these rotors (from 0); loss (SAMPLES, columns): fraction of thrust, a column each."""
    effects: list[Any] = []
    commanded = np.ones((SAMPLES, len(ROTORS)))
    for rotor, lost in zip(rotors, loss.T, strict=False):
        effects.append(("weak_motor", {"rotor": np.full(SAMPLES, rotor + 1.0), "thrust_loss": lost}))
        commanded[:, rotor] += lost / (1.0 - lost)
    return Hypothesis("weak_motor", prior, tuple(effects), commanded_change(commanded), priors.damaged)


def _of_weight(fraction: np.ndarray, samples: Samples) -> np.ndarray:
    """Change (SAMPLES, 4) of the balance by a weight at the places of the samples."""
    return weight_change(fraction, samples.x, samples.y, samples.half_side)
