"""Height over a platform, flown: the same missions by the firmware as it ships and with atHeight.enable."""

from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np

from airtouch.simulation import scenario
from airtouch.simulation.scenario import Scenario
from tools.emulate.compare import SCENARIO, crossings, vehicle
from tools.emulate.flight import Flown, fly

#: of there-and-back: height, end of the take-off's swing, landing at the end
CRUISE_M, SETTLED_S, LAND_S, LAND_AT_M = 0.8, 4.5, 3.5, 1.5
_PLATFORM = """[[platform]]
shape = "rectangle"
size_m = [{size}, 4.0]
centre_m = [{at}, 0.0]
top_m = {top}
material = "acrylic"
"""


@dataclass(frozen=True)
class Case:
    """A mission: surfaces (from, to, top; m), speed, and seconds without a down range."""

    name: str
    surfaces: tuple[tuple[float, float, float], ...]
    speed: float = 0.3
    blind_s: tuple[tuple[float, float], ...] = ()
    lands_there: bool = False  #: on the platform, instead of flying on and back


def stairs(begin: float, end: float, top: float, count: int) -> tuple[tuple[float, float, float], ...]:
    """Steps up from 0 to top and down again beyond the platform between them."""
    edge, far = (end - begin) / count, 0.4
    up = [(begin + i * edge, begin + (i + 1) * edge, top * (i + 1) / (count + 1)) for i in range(count)]
    down = [(2 * end + far - b, 2 * end + far - a, h) for a, b, h in up]
    return (*up, (end, end + far, top), *down)


PLATFORM = ((0.575, 1.325, 0.76),)
CASES = (
    Case("platform 0.76 m high", PLATFORM),
    Case("platform 0.30 m high", ((0.575, 1.325, 0.30),)),
    Case("soft edges, 2 cm wide", stairs(0.555, 0.575, 0.76, 2)),
    Case("twice as fast, tilted", PLATFORM, speed=0.6),
    Case("ramp of 0.2 m over 0.4 m", stairs(0.4, 0.8, 0.2, 20)),
    Case("no down range for 0.3 s, over the platform", PLATFORM, blind_s=((7.5, 7.8),)),
    Case("landing on the platform", ((0.575, 3.575, 0.76),), lands_there=True),
)


def mission(case: Case) -> Scenario:
    """There-and-back over these surfaces."""
    text = SCENARIO.read_text()
    head, rest = text.split("[[platform]]", 1)
    platforms = "".join(_PLATFORM.format(size=b - a, at=0.5 * (a + b), top=h) for a, b, h in case.surfaces)
    steps = rest.split("[mission]", 1)[1].replace("0.3\n", f"{case.speed}\n")
    if case.lands_there:
        before, back = steps.split("[[mission.step]]\ndo = \"hover\"\ntime_s = 1.0\n", 1)
        land = back[back.index('[[mission.step]]\ndo = "land"'):]
        steps = before.replace("distance_m = 1.9", f"distance_m = {LAND_AT_M}") + land
    return scenario.parse(head + platforms + "\n[mission]" + steps, case.name)


def kept(one: Flown) -> tuple[float, float]:
    """Least and greatest true height over the floor between take-off and landing, m."""
    t = one.table[:, 0]
    landing = t[-1] - LAND_S if one.ending == "ok" else np.inf
    cruise = one.table[(t >= SETTLED_S) & (t < landing), 3]
    return (float(cruise.min()), float(cruise.max())) if len(cruise) else (np.nan, np.nan)


def report(elf: Path, seeds: int = 1, only: str = "") -> bool:
    """Fly each case whose name begins so, and print; whether every flight with it ended well."""
    well = True
    print(f"true height over the floor, m, of {CRUISE_M} ordered")
    for case, seed in product([case for case in CASES if case.name.startswith(only)], range(1, seeds + 1)):
        flown = mission(case)
        for on in (0, 1):
            one = fly(elf, flown, vehicle(), seed, parameters={"atHeight.enable": on}, blind_s=case.blind_s)
            low, high = kept(one)
            true = " ".join(f"{kind}@{t:.2f}" for t, kind in crossings(flown, seed, 0, one.table)) or "none"
            felt = " ".join(f"{kind}@{t:.2f}" for t, kind, _ in one.edges) or "none"
            print(f"{case.name}, seed {seed}, {'atHeight.enable 1' if on else 'as it ships'}: {low:.2f} to {high:.2f}, "
                  f"{one.ending} at x {one.table[-1, 1]:.2f}; crossed {true}, felt {felt}; worst stabilizer "
                  f"{one.latency_us} us", flush=True)
            well = well and (on == 0 or one.ending == "ok")
    return well
