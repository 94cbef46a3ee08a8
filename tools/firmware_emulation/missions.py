"""Missions over surfaces of every kind, flown to show what the height over a platform does."""

from dataclasses import dataclass

from airtouch.errors import AirTouchError
from airtouch.simulation import scenario
from airtouch.simulation.scenario import Scenario

from .compare import SCENARIO

#: of there-and-back: height; how far it flies to land on the platform
CRUISE_M, LAND_AT_M = 0.8, 1.5
#: a platform in a scenario file
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
    edges: bool = True  #: surfaces end in edges that can be detected


def stairs(begin: float, end: float, top: float, count: int) -> tuple[tuple[float, float, float], ...]:
    """Steps up from 0 to top and down again beyond the platform between them."""
    edge, far = (end - begin) / count, 0.4
    up = [(begin + i * edge, begin + (i + 1) * edge, top * (i + 1) / (count + 1)) for i in range(count)]
    down = [(2 * end + far - b, 2 * end + far - a, h) for a, b, h in up]
    return (*up, (end, end + far, top), *down)


PLATFORM = ((0.575, 1.325, 0.76),)  #: surfaces of the platform of there-and-back
#: missions that are flown
CASES = (
    Case("platform 0.76 m high", PLATFORM),
    Case("platform 0.30 m high", ((0.575, 1.325, 0.30),)),
    Case("soft edges, 2 cm wide", stairs(0.555, 0.575, 0.76, 2)),
    Case("twice as fast, tilted", PLATFORM, speed=0.6),
    Case("ramp of 0.2 m over 0.4 m", stairs(0.4, 0.8, 0.2, 20), edges=False),
    Case("no down range for 0.3 s, over the platform", PLATFORM, blind_s=((7.5, 7.8),)),
    Case("landing on the platform", ((0.575, 3.575, 0.76),), lands_there=True),
    Case("flat floor", (), edges=False),
)


def cases(only: str = "") -> list[Case]:
    """Cases whose names begin with `only`. AirTouchError where none does."""
    matches = [case for case in CASES if case.name.startswith(only)]
    if not matches:
        raise AirTouchError(f"no case begins with {only!r}; --only is the beginning of one of: "
                            f"{'; '.join(case.name for case in CASES)}")
    return matches


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
