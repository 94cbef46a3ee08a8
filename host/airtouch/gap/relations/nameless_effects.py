"""Two effects that are nameless, as no effect of the registry is them: a force and torque, a property of the plant.

DISTURBANCE is a force and torque in proportion to one of the flight's own signals, a wave or coloured noise. PROPERTY
scales a property of the plant that no effect of the registry changes, or adds to it. `exposure` draws their parameters.
"""

import math
from enum import IntEnum
from functools import cache

import numpy as np

from airtouch.simulation import plant
from airtouch.simulation import signals as at
from airtouch.simulation.compiled import jit
from airtouch.simulation.effects import EFFECTS, Effect, Parameter, wrench
from airtouch.simulation.effects import NAMES as PACKAGE_EFFECTS
from airtouch.simulation.random_generator import normal
from airtouch.vehicle import DEFAULT_VEHICLE, load


class Follows(IntEnum):
    """What a force and torque is in proportion to. The numbers are parameters of flights: they stay as they are."""

    CONSTANT = 0
    VELOCITY = 1  #: one component, body axes
    SPEED = 2
    THRUST = 3  #: beyond the weight
    ROLL_THRUST = 4  #: thrust of the rotors on one side less that on the other
    PITCH_THRUST = 5
    BODY_RATE = 6  #: one component
    NEAR_GROUND = 7  #: exponential in the height
    TIME = 8  #: of the flight
    WAVE = 9  #: sine of a period
    NOISE = 10  #: first-order, of a correlation time
    TILT = 11  #: one horizontal component of the thrust's direction
    POSITION = 12  #: x
    SQUARED_VELOCITY = 13  #: forwards
    ONE_ROTOR = 14  #: its thrust beyond a quarter of the weight


# groups of signals by the quantity they come from; in neither are CONSTANT, TIME and those of a scale (`_of_scale`)
MOTION_SIGNALS = (Follows.VELOCITY, Follows.SPEED, Follows.BODY_RATE, Follows.TILT, Follows.POSITION,
                  Follows.SQUARED_VELOCITY)
THRUST_SIGNALS = (Follows.THRUST, Follows.ROLL_THRUST, Follows.PITCH_THRUST, Follows.ONE_ROTOR)
#: most that is added to a property that is 0, in its unit; chosen
ADDITIONS = {"range_drift": 0.03, "range_dip": 0.02, "motor_hiss": 0.01, "motor_slowness": 0.01,
             "motor_dead_zone": 150.0, "range_mixed": 1.0}
#: properties whose default is 0 although every vehicle has a value
VEHICLE_PROPERTIES = frozenset({"rotor_x", "rotor_y", "rotor_inertia", "yaw_torque_over_thrust"})
#: properties that are no vehicle's, or of parts that these flights do not have
EXCLUDED = frozenset({"step", "gravity", "acc_range", "gyro_range", "nominal_voltage", "voltage_exponent", "firmware",
                      "battery_cells", "power_per_thrust15", "motor_noise_time", "motor_hiss_time", "range_bias_fade",
                      "thrust_curve", "thrust_scale", "rate_scale", "thrust_per_speed2", "loss_burst"})
#: scales by which signals are divided, about as large as these are in an ordinary flight; chosen. Those of the thrust
#: and of its difference between sides are fractions of the weight, that of the tilt is a sine
SPEED_SCALE_MPS, RATE_SCALE_RADPS, TIME_SCALE_S, TILT_SCALE = 0.3, 0.2, 10.0, 0.05
THRUST_SCALE, DIFFERENCE_SCALE = 0.05, 0.02
UNBOUNDED = 1e9  #: s, beyond any flight; and a bound beyond any value of a parameter

#: parameters of the wrench. follows: a `Follows`; axis (0 to 2), scale (height in m, period or correlation time in s),
#: rotor (0 to 3): of those signals that have one; force (N) and torque (N m) where the signal is 1; begin, end (s):
#: when it acts
NAMES = ("follows", "axis", "scale", "rotor", "force_x", "force_y", "force_z", "torque_x", "torque_y", "torque_z",
         "begin", "end")
FOLLOWS, AXIS, SCALE_OF, ROTOR, FORCE, BEGIN, END = map(
    NAMES.index, ("follows", "axis", "scale", "rotor", "force_x", "begin", "end"))


@jit
def _of_motion(follows, axis, s):
    """Signal of one of MOTION_SIGNALS: a velocity, a turning rate, a tilt or a place; axis: 0 to 2."""
    v = at.VELOCITY
    if follows == Follows.VELOCITY:
        return s[v + axis] / SPEED_SCALE_MPS
    if follows == Follows.SPEED:
        return math.sqrt(s[v] * s[v] + s[v + 1] * s[v + 1] + s[v + 2] * s[v + 2]) / SPEED_SCALE_MPS
    if follows == Follows.SQUARED_VELOCITY:
        return s[v] * abs(s[v]) / SPEED_SCALE_MPS ** 2
    if follows == Follows.BODY_RATE:
        return s[at.RATES + axis] / RATE_SCALE_RADPS
    if follows == Follows.TILT:
        return s[at.ROTATION + 2 + 3 * min(axis, 1)] / TILT_SCALE
    return s[at.POSITION]


@jit
def _of_thrust(follows, rotor, s):
    """Signal of one of THRUST_SIGNALS: thrust over the weight of all rotors, of two sides or of one; rotor: 0 to 3."""
    weight, t = s[at.MASS] * s[at.GRAVITY], at.THRUST
    if follows == Follows.THRUST:
        return ((s[t] + s[t + 1] + s[t + 2] + s[t + 3]) / weight - 1.0) / THRUST_SCALE
    if follows == Follows.ROLL_THRUST:
        return (s[t + 2] + s[t + 3] - s[t] - s[t + 1]) / weight / DIFFERENCE_SCALE
    if follows == Follows.PITCH_THRUST:
        return (s[t] + s[t + 3] - s[t + 1] - s[t + 2]) / weight / DIFFERENCE_SCALE
    return 4.0 * s[t + rotor] / weight - 1.0


@jit
def _of_scale(follows, scale, s, memory, stream):
    """Signal of NEAR_GROUND, WAVE or NOISE, whose height (m), period (s) or correlation time (s) is `scale`."""
    if follows == Follows.NEAR_GROUND:
        return math.exp(-s[at.HEIGHT] / scale)
    if follows == Follows.WAVE:
        return math.sin(2.0 * math.pi * s[at.TIME] / scale)
    keep = math.exp(-s[at.STEP] / scale)
    memory[0] = keep * memory[0] + math.sqrt(1.0 - keep * keep) * normal(stream)
    return memory[0]


@wrench
def _disturbance(p, s, memory, stream, out):
    """Force and torque in proportion to a signal x that is about 1 in an ordinary flight."""
    if s[at.TIME] < p[BEGIN] or s[at.TIME] > p[END]:
        return
    follows = int(p[FOLLOWS])
    if follows == Follows.CONSTANT:
        x = 1.0
    elif follows == Follows.TIME:
        x = s[at.TIME] / TIME_SCALE_S
    elif follows in MOTION_SIGNALS:
        x = _of_motion(follows, int(p[AXIS]), s)
    elif follows in THRUST_SIGNALS:
        x = _of_thrust(follows, int(p[ROTOR]), s)
    else:
        x = _of_scale(follows, p[SCALE_OF], s, memory, stream)
    for i in range(6):
        out[i] += p[FORCE + i] * x


def _number(name: str) -> Parameter:
    """A parameter of any value."""
    return Parameter(name, "1", 0.0, -UNBOUNDED, UNBOUNDED, 0.0, name)


DISTURBANCE = Effect("disturbance", "a nameless force and torque", tuple(_number(n) for n in NAMES),
                     wrench=_disturbance)


def _change_property(row, values) -> None:
    """Scale a property of the plant's row, or add to it."""
    name, element, amount = properties()[int(values["property"])], int(values["element"]), values["amount"]
    own = np.array(row[name], float)
    here = np.ones(own.shape, bool) if not own.shape or element < 0 else np.arange(len(own)) == element % len(own)
    row[name] = own + amount * here if name in ADDITIONS else own * np.where(here, amount, 1.0)


#: property: its place in `properties`, as parameters are numbers; element: of a property with several, -1 for all;
#: amount: factor, or what is added
PROPERTY = Effect("property", "a property of the plant that no effect changes",
                  tuple(_number(n) for n in ("property", "element", "amount")), settings=_change_property)


@cache
def properties() -> tuple[str, ...]:
    """Properties of the plant that no effect of the registry changes, and that may be scaled or added to."""
    excluded = _changed_by_effects() | EXCLUDED
    return tuple(name for name, _, default, _ in plant.FIELDS
                 if name not in excluded and (default != 0.0 or name in ADDITIONS or name in VEHICLE_PROPERTIES))


def _changed_by_effects() -> set[str]:
    """Properties that an effect of the package changes."""
    names: set[str] = set()
    for effect in (EFFECTS[n] for n in PACKAGE_EFFECTS if n in EFFECTS):
        if effect.settings is not None:
            before, after = (plant.from_vehicle(load(DEFAULT_VEHICLE)) for _ in range(2))
            moved = {p.name: min(p.default + 0.1 * (p.high - p.low), p.high) for p in effect.parameters}
            effect.settings(after[0], moved)
            names |= {n for n in plant.DTYPE.names or () if n != "firmware" and np.any(before[n] != after[n])}
    return names
