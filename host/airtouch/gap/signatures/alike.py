"""Names of effects that logs do not tell apart, and what would: for one thing in any log at hand, or often confused."""

from collections.abc import Sequence
from typing import NamedTuple


class Confusion(NamedTuple):
    """Effects that logs confuse, what would tell them apart, and the mission that shows it; "" where none does."""

    effects: frozenset[str]
    remedy: str
    mission: str = ""


#: names for one thing in the logs at hand
ALIKE = (
    Confusion(frozenset({"mass", "thrust_coefficient"}),
              "add a fast climb or drop: the same thrust moves a heavier vehicle less, in proportion to its mass only "
              "where an outside force acts; weigh the vehicle, or run one motor on a scale"),
    # one push against the speed; below 0.5 m/s flapping's moment (lever 15 mm) drowns in the floor
    Confusion(frozenset({"rotor_drag", "blade_flapping"}),
              "fly at 1.5 m/s or more, with climbs and drops at speed: flapping's push grows with thrust, rotor drag "
              "with rotor speed, and only flapping pitches the vehicle, if the drag acts at the centre of mass"),
)
#: effects that logs like these confuse at times
CONFUSED = (
    Confusion(frozenset({"motor_lag", "actuator_delay"}),
              "command steps in hover at two step sizes, or log rpm: a lag rounds the response, a delay shifts it"),
    Confusion(frozenset({"motor_lag", "inertia"}),
              "log rpm, or add quick yaw turns: inertia scales every response alike"),
    Confusion(frozenset({"wind", "imu_bias"}),
              "stand still with motors off for five seconds, and turn the vehicle by 90 degrees in hover: wind turns "
              "in body axes and is gone on the ground, a bias is neither"),
    Confusion(frozenset({"weak_motor", "com_offset"}),
              "add yaw turns: a weak rotor leaves yaw torque, an offset does not"),
    Confusion(frozenset({"rotor_drag", "blade_flapping"}),
              "fly faster than 1 m/s: flapping tilts the vehicle as well"),
    Confusion(frozenset({"sensor_latency", "controller_gain"}),
              "log the attitude set-points, or fly steps of attitude: a sweep has them where it starts and stops",
              "there-and-back"),
    Confusion(frozenset({"battery_sag", "thrust_coefficient"}), "log the battery voltage over a whole flight", "hover"),
)
#: what helps where nothing better is known
REMEDY, MISSION = "repeat the flight with other speeds and heights", "there-and-back"


def names_alike(name: str) -> Confusion | None:
    """The effects that these logs do not separate from this one, and what would; None without any."""
    return next((confusion for confusion in ALIKE if name in confusion.effects), None)


def interchangeable(one: str, other: str) -> bool:
    """Whether two names stand for one thing in these logs."""
    alike = names_alike(one)
    return one == other or (alike is not None and other in alike.effects)


def same_things(names: Sequence[str], others: Sequence[str]) -> bool:
    """Whether two lists of effects stand for the same things in these logs, whatever their order."""
    unmatched = list(others)
    for name in names:
        match = next((other for other in unmatched if interchangeable(name, other)), None)
        if match is None:
            return False
        unmatched.remove(match)
    return not unmatched


def confusions_among(names: Sequence[str]) -> list[Confusion]:
    """What tells effects from one another: each pair that is known, then all of them where one is in no known pair."""
    group, known = frozenset(names), {}
    for confusion in (*ALIKE, *CONFUSED):
        if confusion.effects <= group:
            known.setdefault(confusion.effects, confusion)
    in_pairs = frozenset().union(*known)
    return [*known.values(), *([] if group <= in_pairs else [Confusion(group, REMEDY, MISSION)])]
