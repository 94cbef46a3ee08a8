"""Power of signals and coherence between them, band by band, of one flight."""

from functools import cache
from itertools import combinations, pairwise

import numpy as np

from airtouch.gap.features.feature import LEAST_COHERENCE, LEAST_LOG, Feature
from airtouch.gap.features.flight_signals import (
    ANGLE_RESIDUAL,
    ANGULAR_ACCELERATION,
    COMMAND,
    FORCE_RESIDUAL,
    LIFT,
    RANGE_RESIDUAL,
    SPEED_RESIDUAL,
    TORQUE_RESIDUAL,
    FlightSignals,
)
from airtouch.gap.flights.flight import Flight
from airtouch.gap.signals.spectra import AIR, LENGTH, frequencies, short_time_spectra, starts

#: edges of the bands; chosen; the last one lies beyond half the log's rate, 50 Hz, which it so includes
BANDS_HZ = (0.2, 0.6, 1.2, 2.2, 3.5, 5.0, 7.0, 9.5, 13.0, 18.0, 25.0, 35.0, 50.1)
LEAST_POWER = 1e-30  #: power of a band at least, so that it has a logarithm
LACKING_SHARE = 0.2  #: share of the blocks, up to which those that lack a row are left out; chosen
LEAST_ALONE = 1e-4  #: share of a signal's power that the others of its group do not predict, at least
#: signals that move together, each by its name and its column of the table: roll with y, pitch with x, climb, yaw
GROUPS: dict[str, dict[str, int]] = {
    **{axis: {"command": COMMAND.start + 1 + turned, "turn": ANGULAR_ACCELERATION.start + turned,
              "force": FORCE_RESIDUAL.start + pushed, "torque": TORQUE_RESIDUAL.start + turned,
              "speed": SPEED_RESIDUAL.start + pushed, "angle": ANGLE_RESIDUAL.start + turned}
       for axis, turned, pushed in (("roll", 0, 1), ("pitch", 1, 0))},
    "climb": {"command": COMMAND.start, "lift": LIFT.start, "force": FORCE_RESIDUAL.start + 2,
              "speed": SPEED_RESIDUAL.start + 2, "range": RANGE_RESIDUAL.start},
    "yaw": {"command": COMMAND.start + 3, "turn": ANGULAR_ACCELERATION.start + 2, "torque": TORQUE_RESIDUAL.start + 2,
            "angle": ANGLE_RESIDUAL.start + 2},
}


@cache
def declared_features() -> tuple[Feature, ...]:
    """What `coherence_features` gives: group, what of it (power, real, imaginary, alone), signals, number of band."""
    out: list[Feature] = []
    for group, signals in GROUPS.items():
        bands = range(len(BANDS_HZ) - 1)
        out += [Feature(f"{group} power {a} {k}", LEAST_LOG) for a in signals for k in bands]
        out += [Feature(f"{group} {part} {a}:{b} {k}", LEAST_COHERENCE) for a, b in combinations(signals, 2)
                for part in ("real", "imaginary") for k in bands]
        out += [Feature(f"{group} alone {a} {k}", LEAST_LOG) for a in signals for k in bands]
    return tuple(out)


def coherence_features(signals: FlightSignals) -> np.ndarray:
    """Powers and coherences (len(declared_features()),) of a flight in the air; NaN for one without a block.

    Of each group: the logarithm of every signal's power in each band, the complex coherence of every two, and the
    logarithm of the share of a signal's power that the others of the group do not predict (1 less the multiple
    coherence: Bendat and Piersol, Random Data, 4th ed., section 7.3).
    """
    spectra = short_time_spectra(signals.table, _whole(signals.flight, starts(signals.flight, AIR)), AIR)
    columns_of_groups = [list(columns.values()) for columns in GROUPS.values()]
    out = np.concatenate([part for columns in columns_of_groups for part in _of_group(spectra[:, :, columns])])
    return out if len(spectra) else np.full_like(out, np.nan)


def _whole(flight: Flight, first: np.ndarray) -> np.ndarray:
    """The first samples (b,) of those blocks that lack no row, where few lack one; else of all."""
    lost = np.concatenate([[0], np.cumsum(flight.bridged)])
    whole = lost[first + LENGTH[AIR]] == lost[first]
    return first[whole] if (~whole).sum() <= LACKING_SHARE * len(first) else first


def _of_group(spectra: np.ndarray) -> list[np.ndarray]:
    """Powers, coherences and unpredicted shares, each a vector, of spectra (blocks, bins, signals)."""
    of_bins = np.einsum("bfi,bfj->fij", spectra, spectra.conj(), optimize=True) / max(len(spectra), 1)
    cross = np.einsum("kf,fij->kij", _bands(), of_bins, optimize=True)
    power = np.maximum(np.einsum("kii->ki", cross).real, LEAST_POWER)
    coherence = cross / np.sqrt(power[:, :, None] * power[:, None, :])
    many = power.shape[1]
    pairs = [coherence[:, i, j] for i, j in combinations(range(many), 2)]
    inverse = np.linalg.inv(coherence + LEAST_ALONE * np.eye(many))
    alone = -np.log(np.maximum(np.einsum("kii->ki", inverse).real, 1.0 / (1.0 + LEAST_ALONE)))
    return [np.log(power).T.ravel(), *(part for c in pairs for part in (c.real, c.imag)), alone.T.ravel()]


@cache
def _bands() -> np.ndarray:
    """Weights (bands, bins) of the mean over each band."""
    f = frequencies(AIR)
    inside = np.array([(f >= low) & (f < high) for low, high in pairwise(BANDS_HZ)], float)
    return inside / inside.sum(axis=1, keepdims=True)
