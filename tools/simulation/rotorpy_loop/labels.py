"""The flights to make: the effect in each, and how strong it is."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from airtouch.errors import AirTouchError

STEP_S = 0.002  #: of the control loop
MILLISECONDS = "ms"  #: unit of a delay, which is a whole number of steps
#: effect, as a manifest names it -> lowest and highest strength, unit; chosen: as in the flights of FLIGHTS/peers
STRENGTHS = {
    "imu_noise": (3.0, 6.0, "x nominal"), "imu_bias": (0.8, 1.3, "x (0.25 m/s^2, 0.03 rad/s)"),
    "inertia": (0.25, 0.45, "fraction more"), "com_offset": (0.8, 1.6, "mm"), "latency": (5.0, 9.0, MILLISECONDS),
    "act_delay": (6.0, 10.0, MILLISECONDS), "motor_lag": (1.4, 1.8, "x nominal"), "wind": (0.4, 0.7, "m/s"),
    "gust": (0.4, 0.7, "m/s rms"), "rotor_drag": (2.5, 5.0, "x RotorPy's, nominal 0"),
    "weak_motor": (0.07, 0.16, "thrust lost"), "thrust_coeff": (0.07, 0.14, "thrust lost"),
    "mass": (0.08, 0.16, "fraction more"),
    "battery_sag": (0.08, 0.15, "thrust lost at the end"), "vibration": (0.8, 2.0, "m/s^2 peak on each axis"),
    "ground_effect": (0.6, 1.4, "x formula"), "time_jitter": (2.0, 4.0, "ms rms"),
}
#: the same of effects that those flights lack; chosen
OTHERS = {
    "blade_flapping": (0.5, 1.5, "x 1e-8 N m per rad/s and m/s"),
    "motor_noise": (0.02, 0.05, "rms of a rotor's thrust"),
    "packet_loss": (0.05, 0.12, "rows lost"), "controller_gain": (0.55, 0.75, "x rate gains"),
    "downwash": (1.0, 2.0, "x formula"),
}
SEEDS = 1000  #: of one set, so that no flight is in two
FIRST_BASELINE_SEED = 900  #: among these; those of the cases are below it


@dataclass(frozen=True)
class Label:
    """A flight: its file, the effect in it (`none`: no effect) with its strength, and the seed of all that is drawn."""

    file: str
    effect: str
    strength: float
    unit: str
    seed: int

    def of(self, effect: str) -> float:
        """Strength of an effect in this flight, 0 for one that is not there."""
        return self.strength if effect == self.effect else 0.0


def labels_of(each: int, nominal: int, seed: int,
              strengths: Mapping[str, tuple[float, float, str]] = STRENGTHS) -> list[Label]:
    """Two flights for the baseline, so many with each effect and so many without any, in a drawn order.

    strengths: of the effects, STRENGTHS or OTHERS. Raises AirTouchError for more flights than a set has seeds.
    """
    if each * len(strengths) + nominal > FIRST_BASELINE_SEED:
        raise AirTouchError(f"--each and --nominal make more than {FIRST_BASELINE_SEED} flights; ask for fewer")
    rng = np.random.default_rng(seed)
    cases: list[tuple[str, float, str]] = [("none", 0.0, "")] * nominal
    cases += [(name, float(rng.uniform(low, high)), unit) for name, (low, high, unit) in strengths.items()
              for _ in range(each)]
    first = SEEDS * seed
    baseline = [Label(f"cal_A_{i}.csv.gz", "none", 0.0, "", first + FIRST_BASELINE_SEED + i) for i in (0, 1)]
    drawn = []
    for k, i in enumerate(rng.permutation(len(cases))):
        effect, strength, unit = cases[i]
        if unit == MILLISECONDS:
            strength = 1e3 * STEP_S * round(1e-3 * strength / STEP_S)
        drawn.append(Label(f"case_{k:03}.csv.gz", effect, strength, unit, first + k))
    return [*baseline, *drawn]
