"""The lift that a diagnosis gives a vehicle close to the floor, against what was measured on neural-swarm's flights."""

from pathlib import Path

import numpy as np

from airtouch import vehicle as vehicles
from airtouch.simulation import effects, replay
from airtouch.simulation import signals as at
from airtouch.simulation.effects import Active
from airtouch.simulation.flight import prepare

from .result_store import Result

#: m above standing at which the lift was measured (flights' medians, the data's SOURCE.md); nothing from 15 cm on,
#: level below 1 cm
CURVE_M = np.array([0.01, 0.02, 0.03, 0.04, 0.05, 0.06, 0.073, 0.09, 0.115, 0.15])
#: vehicle -> fraction of the weight that the ground carries at CURVE_M
CURVE = {"ns-34g": np.array([13.8, 9.7, 7.3, 5.7, 3.5, 1.8, 0.6, 0.1, -0.1, 0.0]) / 100.0,
         "ns-67g": np.array([13.6, 10.2, 8.0, 6.5, 5.3, 4.2, 3.4, 2.0, 0.8, 0.0]) / 100.0}
HEIGHTS_M = (0.02, 0.04)  #: above standing, at which a diagnosis is compared with the measured lift
#: height of the rotors when it stands, as the diagnosis takes it from z_m, m; the large one's marker sits 5 mm higher
STANDING_M = {"ns-34g": 0.0325, "ns-67g": 0.036}
CLOSE = 0.25  #: relative difference from the measured lift that counts as right; a goal of host/docs/gap-real.md


def lift(vehicle: Path, name: str, parameters: dict[str, float]) -> np.ndarray:
    """Share (2,) of the weight that `ground_effect` carries in hover at HEIGHTS_M: g / (1 + g) of a thrust gain g."""
    craft = vehicles.load(vehicle)
    row = prepare(craft, ())[0][0]
    signals = np.zeros((len(HEIGHTS_M), at.COUNT))
    signals[:, at.STEP], signals[:, at.MASS], signals[:, at.GRAVITY] = 0.01, craft.mass_kg, craft.gravity_mps2
    signals[:, at.ROTATION], signals[:, at.ROTATION + 4], signals[:, at.ROTATION + 8] = 1.0, 1.0, 1.0
    signals[:, at.ROTOR_X:at.ROTOR_X + 4], signals[:, at.ROTOR_Y:at.ROTOR_Y + 4] = row["rotor_x"], row["rotor_y"]
    signals[:, at.ROTOR_RADIUS], signals[:, at.ROTOR_SPACING] = row["rotor_radius"], row["rotor_spacing"]
    signals[:, at.THRUST:at.THRUST + 4] = 0.25 * craft.mass_kg * craft.gravity_mps2
    signals[:, at.LOWER_FACTOR:at.LOWER_FACTOR + 4] = 1.0
    signals[:, at.LOWER_HEIGHT:at.LOWER_HEIGHT + 4] = (np.array(HEIGHTS_M) + STANDING_M[name])[:, None]
    steady = Active(effects.get("ground_effect"), {**parameters, "turbulence": 0.0})
    gain = replay.wrench_of(steady, signals)[:, 2] / (craft.mass_kg * craft.gravity_mps2)
    return gain / (1.0 + gain)


def close(result: Result, folder: Path) -> bool:
    """Whether the ground effect that a diagnosis names is within CLOSE of the measured lift at both heights."""
    effect = next((e for e in result["effects"] if e["name"] == "ground_effect"), None)
    if effect is None:
        return False
    name = result["condition"]
    carried = lift(folder / f"{name}.toml", name, {k: q["value"] for k, q in effect["parameters"].items()})
    measured = np.interp(HEIGHTS_M, CURVE_M, CURVE[name])
    return bool((np.abs(carried / measured - 1.0) < CLOSE).all())
