"""The closed loop of nominal flights: the firmware's controller or one fitted to the spectra, noise, floor.

The commands' measured power p is held against the model m = sum of strength_i m_i by Whittle's likelihood (1953), nats
a block: -sum over bins of (log m + p / m). Its maximum over the strengths is the minimum of the Itakura-Saito
divergence, which multiplicative updates never raise (Fevotte and Idier, Neural Computation 23, 2011).
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numba import float64, int64, njit, types
from scipy.optimize import minimize

from airtouch.gap.edges.edge_response import edge_floor_of
from airtouch.gap.flights.blocks import smooth_power
from airtouch.gap.flights.flight import Flight
from airtouch.gap.flights.hardness import hardness_of, slopes_of
from airtouch.gap.loop.axis_plant import AxisPlant, PlantRow, axis_plant
from airtouch.gap.loop.closed_loop import ClosedLoop
from airtouch.gap.loop.command_spectra import (
    COMMAND_LENGTH,
    block_spectra,
    command_frequencies,
    fine_frequencies,
    through_window,
    typical,
)
from airtouch.gap.loop.controller import AXES, Controller, firmware
from airtouch.gap.loop.noise_spectra import noise_power
from airtouch.simulation.effects import Active
from airtouch.simulation.flight import prepare
from airtouch.vehicle import Vehicle

FEWEST_COMMAND_BLOCKS = 6  #: blocks of nominal flights, for a command view; chosen
#: nats by which fitted gains must be likelier than the firmware's documented ones, for each axis; chosen
FREE_GAINS = 1.5
FLOOR_SMOOTH = 3.0  #: bins, standard deviation of the Gaussian that smooths the floor over the model's shape; chosen
LEAST_STRENGTH = 1e-9  #: of a noise, over the whole, so that it can grow again
LEAST_VELOCITY_GAIN = 1e-3  #: rad per m/s, of a velocity loop that is searched
UPDATES = 300  #: updates of noise strengths; chosen
SEARCH_UPDATES = 40  #: updates of noise strengths for each controller that a search tries; chosen
SEARCH_BLOCKS = 8.0  #: blocks that the misfit counts for against the prior of the gains in a search; chosen
#: standard deviations of that prior, nepers around the firmware's gains: rate (climb), angle (height), velocity; chosen
GAIN_SPREAD = (0.7, 0.4, 0.5)
#: the first of them with which the two searches begin, in such standard deviations; chosen
FIRST_GAINS = (-1.0, 0.5)
#: of a search's simplex: most trials, and where it ends, in such standard deviations and in nats; chosen
SIMPLEX = {"maxfev": 80, "xatol": 0.03, "fatol": 0.02}


class AxisFit(NamedTuple):
    """A controller of one axis with the noise that explains the commands best.

    strengths (sources,): as in `noise_spectra.noise_power`; misfit: the negative log likelihood a block, nats, above
    that of a model that fits every bin.
    """

    controller: Controller
    strengths: np.ndarray
    misfit: float


def identify(flights: Sequence[Flight], vehicle: Vehicle, calibration: Sequence[Active] = ()) -> ClosedLoop | None:
    """Controller, noise and floor of flights declared nominal; None where they have too few blocks."""
    by_flight = [block_spectra(f, vehicle) for f in flights]
    if sum(len(first) for first, _ in by_flight) < FEWEST_COMMAND_BLOCKS:
        return None
    hardness = np.concatenate([hardness_of(f, first, COMMAND_LENGTH)
                               for f, (first, _) in zip(flights, by_flight, strict=True)])
    powers = np.abs(np.concatenate([s for _, s in by_flight])) ** 2
    slopes = slopes_of(powers, hardness, command_frequencies())
    power = typical(powers / slopes.relative_power(hardness))
    row = prepare(vehicle, calibration)[0][0]
    documented = [noise_strengths(firmware(row, a), axis_plant(row, a), power[:, i]) for i, a in enumerate(AXES)]
    searched = [_search(row, a, power[:, i]) for i, a in enumerate(AXES)]
    weight = 0.5 * len(powers)  # half overlapping blocks hold each sample twice
    by_firmware = (weight * sum(axis.misfit for axis in documented)
                   < weight * sum(axis.misfit for axis in searched) + FREE_GAINS * len(AXES))
    fitted = documented if by_firmware else searched
    loop = ClosedLoop(
        vehicle=vehicle, calibration=tuple(calibration), controllers=tuple(axis.controller for axis in fitted),
        by_firmware=by_firmware, strengths=tuple(axis.strengths for axis in fitted), floor=power, blocks=len(powers),
        slopes=slopes, edges=edge_floor_of(flights, vehicle, calibration))
    model = loop.nominal_power()
    return replace(loop, floor=model * smooth_power(power / model, np.array(len(powers)), FLOOR_SMOOTH))


def noise_strengths(controller: Controller, plant: AxisPlant, power: np.ndarray, updates: int = UPDATES,
                    ) -> AxisFit:
    """The noise strengths of highest likelihood for a command's power (bins,), N^2/Hz, under a controller."""
    shapes = through_window(noise_power(controller, plant, fine_frequencies()))
    scale = power.mean() / shapes.mean(axis=1)
    shapes = shapes * scale[:, None]
    strengths = np.full(len(shapes), 1.0 / len(shapes))
    _update(strengths, np.ascontiguousarray(shapes), np.ascontiguousarray(power), updates)
    over_model = power / (strengths @ shapes)
    return AxisFit(controller, strengths * scale, float((over_model - np.log(over_model) - 1.0).sum()))


@njit(types.void(float64[::1], float64[:, ::1], float64[::1], int64), cache=True, error_model="numpy")
def _update(strengths, shapes, power, updates):
    """Multiplicative updates of strengths (sources,) that lower the Itakura-Saito divergence, in place.

    shapes (sources, bins): power for unit strengths; power (bins,): as measured.
    """
    sources, bins = shapes.shape
    over, square = np.empty(bins), np.empty(bins)
    for _ in range(updates):
        for b in range(bins):
            model = 0.0
            for s in range(sources):
                model += strengths[s] * shapes[s, b]
            over[b] = 1.0 / model
            square[b] = power[b] * over[b] * over[b]
        for s in range(sources):
            up, down = 0.0, 0.0
            for b in range(bins):
                up += shapes[s, b] * square[b]
                down += shapes[s, b] * over[b]
            strengths[s] = max(strengths[s] * np.sqrt(up / down), LEAST_STRENGTH)


def _search(row: PlantRow, axis: str, power: np.ndarray) -> AxisFit:
    """The gains of a cascade, near the firmware's, of highest posterior for the shape of a command's power (bins,)."""
    known, plant = firmware(row, axis), axis_plant(row, axis)
    middle = np.log([known.gain, known.angle, max(known.velocity, LEAST_VELOCITY_GAIN)])
    spread = np.array(GAIN_SPREAD)
    free = 2 if axis == "thrust" else 3

    def controller(x: np.ndarray) -> Controller:
        """The cascade at gains x (free,), in standard deviations of their prior."""
        values = np.exp(middle + spread * np.concatenate([x, np.zeros(3 - len(x))]))
        return Controller(values[0], values[1], values[2] if free == 3 else 0.0)

    def cost(x: np.ndarray) -> float:
        """Minus the log posterior of gains x, nats."""
        return SEARCH_BLOCKS * noise_strengths(controller(x), plant, power, SEARCH_UPDATES).misfit + 0.5 * float(x @ x)

    corners = [np.vstack([[g, *np.zeros(free - 1)], np.eye(free) + [g, *np.zeros(free - 1)]]) for g in FIRST_GAINS]
    best = min((minimize(cost, x[0], method="Nelder-Mead", options={"initial_simplex": x, **SIMPLEX})
                for x in corners), key=lambda r: r.fun)
    return noise_strengths(controller(best.x), plant, power)
