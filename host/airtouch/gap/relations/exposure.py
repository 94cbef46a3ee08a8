"""Disturbances without a name: what flights look like in which something acts that no effect of the registry is.

A random force and torque that follows one of the flight's own signals, a wave or coloured noise, for the whole flight
or for some seconds; or a property of the plant that no effect of the registry changes. Such flights say what `unknown`
looks like (outlier exposure: Hendrycks, Mazeika, Dietterich, ICLR 2019).
"""

import math
from functools import cache

import numpy as np

from airtouch.gap.signatures.drawn import log_uniform
from airtouch.simulation import plant
from airtouch.simulation import signals as at
from airtouch.simulation.effects import EFFECTS, Active, Effect, Parameter, wrench
from airtouch.simulation.effects import NAMES as PACKAGE
from airtouch.simulation.random_generator import normal
from airtouch.vehicle import load

KIND, FORCE, TIME, BEGIN, END = 0, 1, 7, 8, 9  #: places of the wrench's parameters; force and torque are six
CONSTANT, VELOCITY, SPEED, THRUST, ROLLED, PITCHED, RATE, LOW, LATER, WAVE, NOISE, TILT, PLACE, DRAG, ROTOR = range(15)
#: kinds and how often each is drawn: those that have three axes three times
DRAWN = (CONSTANT, *(VELOCITY,) * 3, SPEED, THRUST, ROLLED, PITCHED, *(RATE,) * 3, LOW, LATER, WAVE, *(NOISE,) * 3,
         TILT, TILT, PLACE, DRAG, ROTOR)
WRENCHES = 0.75  #: share of the disturbances that are a force and torque
ALWAYS = 0.7  #: share of these that act for the whole flight
FORCE_N = (1e-4, 7e-3)  #: size of a wrench; of a torque with LEVER_M
LEVER_M = 0.01
ANY_VEHICLE = "crazyflie-2.1-flow"  #: one on which it is tried which properties effects change
FACTOR = (0.003, 0.5)  #: logarithm of the factor of a property
ADDED = {"range_drift": 0.03, "range_dip": 0.02, "motor_hiss": 0.01, "motor_slowness": 0.01, "motor_dead_zone": 150.0,
         "range_mixed": 1.0}  #: of properties that are 0, what is added at most
#: properties that are no vehicle's, or of parts that these flights do not have
LEFT_OUT = frozenset({"step", "gravity", "acc_range", "gyro_range", "nominal_voltage", "voltage_exponent", "firmware",
                      "battery_cells", "power_per_thrust15", "motor_noise_time", "motor_hiss_time", "range_bias_fade",
                      "thrust_curve", "thrust_scale", "rate_scale", "thrust_per_speed2", "loss_burst"})


@wrench
def _disturbance(p, s, memory, stream, out):
    if s[at.TIME] < p[BEGIN] or s[at.TIME] > p[END]:
        return
    kind, weight, x = int(p[KIND]) // 3, s[at.MASS] * s[at.GRAVITY], 0.0
    axis = int(p[KIND]) - 3 * kind
    t = at.THRUST
    vx, vy, vz = s[at.VELOCITY], s[at.VELOCITY + 1], s[at.VELOCITY + 2]
    if kind == CONSTANT:
        x = 1.0
    elif kind == VELOCITY:
        x = s[at.VELOCITY + axis] / 0.3
    elif kind == SPEED:
        x = math.sqrt(vx * vx + vy * vy + vz * vz) / 0.3
    elif kind == THRUST:
        x = ((s[t] + s[t + 1] + s[t + 2] + s[t + 3]) / weight - 1.0) / 0.05
    elif kind == ROLLED:
        x = (s[t + 2] + s[t + 3] - s[t] - s[t + 1]) / weight / 0.02
    elif kind == PITCHED:
        x = (s[t] + s[t + 3] - s[t + 1] - s[t + 2]) / weight / 0.02
    elif kind == RATE:
        x = s[at.RATES + axis] / 0.2
    elif kind == LOW:
        x = math.exp(-s[at.HEIGHT] / p[TIME])
    elif kind == LATER:
        x = s[at.TIME] / 10.0
    elif kind == WAVE:
        x = math.sin(2.0 * math.pi * s[at.TIME] / p[TIME])
    elif kind == NOISE:
        keep = math.exp(-s[at.STEP] / p[TIME])
        memory[0] = keep * memory[0] + math.sqrt(1.0 - keep * keep) * normal(stream)
        x = memory[0]
    elif kind == TILT:
        x = s[at.ROTATION + 2 + 3 * min(axis, 1)] / 0.05
    elif kind == PLACE:
        x = s[at.POSITION]
    elif kind == DRAG:
        x = vx * abs(vx) / 0.09
    else:
        x = 4.0 * s[t + min(int(p[TIME]), 3)] / weight - 1.0
    for i in range(6):
        out[i] += p[FORCE + i] * x


def _number(name: str) -> Parameter:
    return Parameter(name, "1", 0.0, -1e9, 1e9, 0.0, name)


NAMES = ("kind", "force_x", "force_y", "force_z", "torque_x", "torque_y", "torque_z", "time", "begin", "end")
DISTURBANCE = Effect("disturbance", "a force and torque without a name", tuple(_number(n) for n in NAMES),
                     wrench=_disturbance)


def _change(row, values) -> None:
    name, which, amount = properties()[int(values["property"])], int(values["which"]), values["amount"]
    own = np.array(row[name], float)
    here = np.ones(own.shape, bool) if not own.shape or which < 0 else np.arange(len(own)) == which % len(own)
    row[name] = own + amount * here if name in ADDED else own * np.where(here, amount, 1.0)


PROPERTY = Effect("property", "a property of the plant that no effect changes",
                  tuple(_number(n) for n in ("property", "which", "amount")), settings=_change)


@cache
def properties() -> tuple[str, ...]:
    """Properties of the plant that no effect of the registry changes, and that may be scaled or added to."""
    return tuple(name for name, _, default, _ in plant.FIELDS if name not in _changed() | LEFT_OUT
                 and (name in ADDED or default != 0.0 or name in ("rotor_x", "rotor_y", "rotor_inertia",
                                                                  "yaw_torque_over_thrust")))


def _changed() -> set[str]:
    """Properties that an effect of the package changes."""
    out: set[str] = set()
    for effect in (EFFECTS[n] for n in PACKAGE if n in EFFECTS):
        if effect.settings is not None:
            before, after = (plant.from_vehicle(load(ANY_VEHICLE)) for _ in range(2))
            moved = {p.name: min(p.default + 0.1 * (p.high - p.low), p.high) for p in effect.parameters}
            effect.settings(after[0], moved)
            out |= {n for n in plant.DTYPE.names or () if n != "firmware" and np.any(before[n] != after[n])}
    return out


def draw(rng: np.random.Generator) -> list[Active]:
    """A disturbance, ready to be flown."""
    if rng.random() >= WRENCHES:
        every = properties()
        which = int(rng.integers(len(every)))
        size = log_uniform(*FACTOR, rng)
        amount = ADDED[every[which]] * size / FACTOR[1] if every[which] in ADDED else np.exp(size * rng.choice([-1, 1]))
        where = float(rng.integers(-1, 4))
        return [Active(PROPERTY, {"property": float(which), "which": where, "amount": float(amount)})]
    kind, axis = int(rng.choice(DRAWN)), int(rng.integers(3))
    way, parts = rng.normal(size=6), int(rng.integers(4))
    if parts == 0:
        way[3:] = 0.0
    elif parts == 1:
        way[:3] = 0.0
    elif parts == 2:
        way *= np.arange(6) == rng.integers(6)
    way *= log_uniform(*FORCE_N, rng) / np.linalg.norm(way)
    way[3:] *= LEVER_M
    time = {LOW: (0.02, 0.4), WAVE: (0.025, 5.0), NOISE: (0.004, 2.0)}.get(kind)
    scale = log_uniform(*time, rng) if time else float(rng.integers(4))
    begin = float(rng.uniform(2.0, 20.0))
    stretch = (0.0, 1e9) if rng.random() < ALWAYS else (begin, begin + float(rng.uniform(1.0, 8.0)))
    return [Active(DISTURBANCE, dict(zip(NAMES, map(float, (3 * kind + axis, *way, scale, *stretch)), strict=True)))]
