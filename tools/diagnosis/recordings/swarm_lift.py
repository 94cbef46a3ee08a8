"""The lift that a diagnosis gives a vehicle close to the floor, against what was measured on neural-swarm's flights."""

from pathlib import Path

import numpy as np

from airtouch import vehicle as vehicles
from airtouch.simulation import effects, replay
from airtouch.simulation import signals as at
from airtouch.simulation.effects import Active
from airtouch.simulation.flight import prepare

#: height above standing, m; fraction of the weight that the ground carries there (flights' medians,
#: the data's SOURCE.md)
HEIGHTS_M, MEASURED = (0.02, 0.04), {"ns-34g": (0.097, 0.057), "ns-67g": (0.102, 0.065)}
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


def close(case: dict, folder: Path) -> bool:
    """Whether a diagnosed flight's ground effect is within CLOSE of the measured lift at both heights."""
    effect = next((e for e in case["effects"] if e["name"] == "ground_effect"), None)
    if effect is None:
        return False
    name = case["condition"]
    carried = lift(folder / f"{name}.toml", name, {k: q["value"] for k, q in effect["parameters"].items()})
    return bool((np.abs(carried / MEASURED[name] - 1.0) < CLOSE).all())
