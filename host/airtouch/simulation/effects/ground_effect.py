"""More thrust close to a surface, rotor by rotor, with the unsteady air that comes with it."""

import math

from airtouch.simulation import signals as at
from airtouch.simulation.compiled import jit
from airtouch.simulation.effects.effect import Effect, Parameter, wrench
from airtouch.simulation.random_stream import normal

STRENGTH, FOUNTAIN, FADE, TURBULENCE, TURBULENCE_TIME = range(5)
STEP, DECAY, FRESH = range(8, 11)  #: of the memory: what follows from the step's length
LEAST_HEIGHT_RADII = 0.75  #: the formula diverges below it


@jit
def thrust_ratio(height, radius, spacing, fountain):
    """Thrust near a surface over thrust far from it, minus one, for a rotor of a quadrotor.

    height: rotor disc over the surface, m. spacing: between neighbouring rotors, m.
    fountain: weight of the lift on the body (the paper's K_b = 2).
    Source: Sanchez-Cuevas, Heredia, Ollero, Characterization of the Aerodynamic Ground
    Effect and Its Influence in Multirotor Control, 2017, eq. 8.
    """
    z = max(height, LEAST_HEIGHT_RADII * radius)
    r2, d2, z2 = radius * radius, spacing * spacing, 4.0 * z * z
    near, far = d2 + z2, 2.0 * d2 + z2
    far *= math.sqrt(far)
    loss = r2 / (4.0 * z2) + r2 * z / (near * math.sqrt(near)) + (0.5 + 2.0 * fountain) * r2 * z / far
    return 1.0 / (1.0 - min(loss, 0.9)) - 1.0


@jit
def faded(ratio, height, fade):
    """The ratio where the lift dies out over `fade` m beyond the formula's own decay (0: it does not)."""
    return ratio * math.exp(-(height / fade) ** 2) if fade > 0.0 else ratio


@wrench
def ground_effect(p, s, memory, stream, out):
    if memory[STEP] != s[at.STEP]:
        memory[STEP], memory[DECAY] = s[at.STEP], math.exp(-s[at.STEP] / p[TURBULENCE_TIME])
        memory[FRESH] = math.sqrt(1.0 - memory[DECAY] ** 2)
    decay, fresh = memory[DECAY], memory[FRESH]
    radius, spacing = s[at.ROTOR_RADIUS], s[at.ROTOR_SPACING]
    for i in range(4):
        height, share = s[at.LOWER_HEIGHT + i], s[at.COVER + i]
        near = (1.0 - share) * s[at.LOWER_FACTOR + i] * thrust_ratio(height, radius, spacing, p[FOUNTAIN])
        lift = faded(near, height, p[FADE])
        rough = near * s[at.LOWER_ROUGHNESS + i]
        if share > 0.0:
            height = s[at.UPPER_HEIGHT + i]
            near = share * s[at.UPPER_FACTOR + i] * thrust_ratio(height, radius, spacing, p[FOUNTAIN])
            lift += faded(near, height, p[FADE])
            rough += near * s[at.UPPER_ROUGHNESS + i]
        memory[i] = decay * memory[i] + fresh * normal(stream)
        force = p[STRENGTH] * s[at.THRUST + i] * (lift + p[TURBULENCE] * rough * memory[i])
        out[2] += force
        out[3] += s[at.ROTOR_Y + i] * force
        out[4] -= s[at.ROTOR_X + i] * force


EFFECT = Effect(
    "ground_effect", "more and unsteadier thrust close to a surface, each rotor on its own",
    (Parameter("strength", "1", 1.0, 0.0, 3.0, 0.0, "times the published curve",
               "Sanchez-Cuevas 2017, eq. 8"),
     Parameter("fountain", "1", 2.0, 0.0, 5.0, None, "weight of the lift on the body, K_b",
               "Sanchez-Cuevas 2017: 2"),
     Parameter("fade", "m", 0.0, 0.0, 1.0, None,
               "height over which the mean lift dies out faster than published; 0: as published",
               "the authors' flights show nothing above 65 mm down range"),
     Parameter("turbulence", "1", 0.3, 0.0, 3.0, 0.0,
               "rms of the force over the published mean, on a surface of roughness 1",
               "roll rate 3.5 to 17.6 deg/s rms over the platform in the authors' low flights"),
     Parameter("turbulence_time", "s", 0.02, 0.002, 1.0, None, "its correlation time",
               "rotor radius over wake speed, x 3")),
    wrench=ground_effect)
