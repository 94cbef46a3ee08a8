"""Extra power of the torque in the replay view: what effects of the control loop add to its floor."""

from collections.abc import Sequence

import numpy as np

from airtouch.gap.evidence.data import Data, residual_spectra, step_doubt
from airtouch.gap.evidence.flattened import Flattened
from airtouch.gap.loop.torque_share import Change
from airtouch.gap.signals.channels import COUNT, TORQUE
from airtouch.gap.signals.response import FIRST_BIN
from airtouch.gap.signals.spectra import AIR, REST, frequencies, squared
from airtouch.gap.signatures.signature import signature_of
from airtouch.simulation.effects import Active

#: relative error of the loop model in a change of the torque by effects that change the loop; chosen
#: (host/docs/gap-method.md). A larger number gives these effects less evidence
TORQUE_DOUBT = 0.25


def extra_torque_power(data: Data, flat: Flattened, active: Sequence[Active]) -> np.ndarray:
    """Power (replay,) that effects add to the floor of the torque, unit^2/Hz; 0 in other channels.

    It is the power that the changed loop makes of noise, less the present one's, and the loop model's error.
    """
    loop, count = data.study.loop, flat.replay_count
    effects = beside_edges(active) if loop and count else []
    loop_change = loop.torque_change(effects, frequencies(AIR)) if loop and effects else None
    if loop_change is None:
        return np.zeros(count)
    gather, flights = flat.layout.gather, flat.layout.flights
    without, valid = flat.elements.residual[:count], flat.elements.valid[:count]
    change = np.where(valid, gather(residual_spectra(data, effects, flights)) - without, 0.0)
    step_power = step_doubt(data, effects, flights)
    doubt = TORQUE_DOUBT ** 2 * squared(change) * flat.is_torque
    if step_power is not None:
        doubt = doubt + gather(step_power).real
    return doubt + flat.noise * _noise_growth(data, flat, loop_change)


def _noise_growth(data: Data, flat: Flattened, change: Change) -> np.ndarray:
    """Factor (replay,) of a changed loop on the torque's floor, less 1, as far as that is noise of the loop."""
    before, after = change.incoherent
    table = np.zeros((len(before), COUNT))
    nominal = data.study.floor.power[AIR][:, TORQUE]
    table[FIRST_BIN:, TORQUE] = (np.minimum(before / nominal, 1.0) * (after / before - 1.0))[FIRST_BIN:]
    return flat.layout.per_bin({AIR: table, REST: np.zeros(flat.layout.keep[REST].shape)})


def loops_differ(data: Data, before: Sequence[Active], after: Sequence[Active]) -> bool:
    """Whether the loops of roll and pitch differ between two hypotheses."""
    loop = data.study.loop
    return loop is not None and not loop.same_loop(before, after)


def beside_edges(active: Sequence[Active]) -> list[Active]:
    """The effects that show elsewhere than at edges alone: in the replay, or in the loop within it."""
    return [a for a in active if not signature_of(a.effect).edges_only]
