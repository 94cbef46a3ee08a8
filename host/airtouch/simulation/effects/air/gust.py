"""Dryden gusts: random wind with a known spectrum, through the rotors' drag.

`lever` is the height of that drag over the centre of mass, as of `wind`. `shear` adds what eddies as
small as the vehicle do: the sideways air differs from its front to its back by r_g (MIL-F-8785C),
v_g through s/V / (1 + 3 b/(pi V) s), and turns it.
"""

import math

from airtouch.simulation import signals as at
from airtouch.simulation.effects.effect import Effect, Parameter, wrench
from airtouch.simulation.random_generator import normal

RMS, LENGTH, AIRSPEED, DRAG, LEVER, SHEAR = range(6)
SLOW = 5  #: of the memory: the sideways air over the vehicle's length
STEP, DECAY, FRESH, WHITE = range(8, 12)  #: of the memory: what follows from the step's length
ROOT_3 = math.sqrt(3.0)


@wrench
def gust(p, s, memory, generator, out):
    # memory: world x through one lag of tau; world y and z each through two; y through one more
    h = s[at.STEP]
    if memory[STEP] != h:
        tau = p[LENGTH] / p[AIRSPEED]
        memory[STEP], memory[DECAY] = h, math.exp(-h / tau)
        memory[FRESH] = math.sqrt(1.0 - memory[DECAY] ** 2)
        memory[WHITE] = math.sqrt(tau / h)  # held white noise of density tau: gives both shapes unit variance
    decay, white = memory[DECAY], memory[WHITE]
    memory[0] = decay * memory[0] + memory[FRESH] * normal(generator)
    for axis in range(2):
        first, second = 1 + 2 * axis, 2 + 2 * axis
        memory[first] = decay * memory[first] + (1.0 - decay) * white * normal(generator)
        memory[second] = decay * memory[second] + (1.0 - decay) * memory[first]
    # (1 + sqrt(3) tau s) / (1 + tau s)^2 in partial fractions
    x = memory[0]
    y = ROOT_3 * memory[1] + (1.0 - ROOT_3) * memory[2]
    z = ROOT_3 * memory[3] + (1.0 - ROOT_3) * memory[4]
    total = s[at.ROTOR_SPEED] + s[at.ROTOR_SPEED + 1] + s[at.ROTOR_SPEED + 2] + s[at.ROTOR_SPEED + 3]
    drag = p[DRAG] * p[RMS] * total / (4.0 * s[at.HOVER_SPEED])
    r = at.ROTATION
    force_x = drag * (s[r] * x + s[r + 3] * y + s[r + 6] * z)
    force_y = drag * (s[r + 1] * x + s[r + 4] * y + s[r + 7] * z)
    out[0] += force_x
    out[1] += force_y
    out[3] -= p[LEVER] * force_y
    out[4] += p[LEVER] * force_x
    if p[SHEAR] > 0.0:
        lag = 3.0 * s[at.ROTOR_SPACING] / (math.pi * p[AIRSPEED])
        change = (1.0 - math.exp(-h / lag)) * (y - memory[SLOW])
        gradient = (memory[SLOW] + 0.5 * change - y) / (lag * p[AIRSPEED])  # along x, rms per m
        memory[SLOW] += change
        apart = 0.0
        for i in range(4):
            apart += 0.25 * s[at.ROTOR_X + i] ** 2
        out[5] += p[SHEAR] * drag * apart * gradient


EFFECT = Effect(
    "gust", "Dryden turbulence of zero mean, through the rotors' horizontal drag",
    (Parameter("rms", "m/s", 0.3, 0.0, 10.0, 0.0, "of each component", "MIL-F-8785C, Dryden form"),
     Parameter("length", "m", 0.5, 0.01, 500.0, None, "turbulence scale",
               "size of a fan's or a door's eddies"),
     Parameter("airspeed", "m/s", 1.0, 0.05, 30.0, None, "at which the turbulence is carried past"),
     Parameter("drag", "N s/m", 0.0147, 0.0, 2.0, None, "horizontal drag at hover", "drone-models"),
     Parameter("lever", "m", 0.0, -0.1, 0.1, 0.0, "where the drag acts, over the centre of mass",
               "discs of a Crazyflie 2.1: 0.01; with hub moments and inflow skew more"),
     Parameter("shear", "1", 0.0, 0.0, 5.0, 0.0, "yaw torque of the eddies over the published one",
               "MIL-F-8785C, r_g over the rotors' spacing")),
    wrench=gust)
