"""A lithium-polymer battery: open-circuit voltage by charge, internal resistance, drain."""

import numpy as np

from airtouch.simulation.compiled import jit

#: charge: share of the capacity that is left; volts: at the terminals
STATE = np.dtype([("charge", np.float64), ("volts", np.float64)])
#: Charge left and open-circuit voltage of one cell: typical LiPo discharge curve.
CHARGE = np.array([0.0, 0.05, 0.1, 0.2, 0.4, 0.6, 0.8, 0.9, 1.0])
OPEN_CIRCUIT_V = np.array([3.20, 3.45, 3.58, 3.68, 3.77, 3.87, 4.00, 4.08, 4.18])


@jit
def open_circuit(charge):
    """Open-circuit voltage of one cell at a charge of 0..1, V."""
    if charge <= CHARGE[0]:
        return OPEN_CIRCUIT_V[0]
    for i in range(1, len(CHARGE)):
        if charge <= CHARGE[i]:
            share = (charge - CHARGE[i - 1]) / (CHARGE[i] - CHARGE[i - 1])
            return OPEN_CIRCUIT_V[i - 1] + share * (OPEN_CIRCUIT_V[i] - OPEN_CIRCUIT_V[i - 1])
    return OPEN_CIRCUIT_V[-1]


@jit
def drain(plant, charge, power, h):
    """One step of h seconds at `power` watts: (charge left, terminal voltage).

    The current solves V = E - R I, P = V I; where the battery cannot give that power
    the voltage is half the open-circuit one.
    """
    e = plant.battery_cells * open_circuit(charge)
    root = e * e - 4.0 * plant.battery_resistance * power
    volts = 0.5 * (e + np.sqrt(root)) if root > 0.0 else 0.5 * e
    return max(charge - h * power / volts / plant.battery_capacity, 0.0), volts


@jit
def supply(plant, battery_volts):
    """Voltage that the motors see: nominal at strength 0, the battery's at strength 1."""
    return plant.nominal_voltage + plant.battery_strength * (battery_volts - plant.nominal_voltage)
