"""More thrust close to a surface, rotor by rotor, with the unsteady air that comes with it."""

import math

from airtouch.simulation import signals as at
from airtouch.simulation.compiled import jit
from airtouch.simulation.effects.effect import Effect, Parameter, wrench
from airtouch.simulation.random_generator import normal

STRENGTH, FOUNTAIN, FADE, TURBULENCE, TURBULENCE_TIME, HEAVE, PITCH, SWIRL, EVEN, LEAVING, JOINT = range(11)
LIFT = 4  #: 4, of the memory: mean lift of each rotor over its thrust
STEP, DECAY, FRESH = range(8, 11)  #: of the memory: what follows from the step's length
WHOLE = 11  #: of the memory: height of the rotors when one surface was last below all of them, m
#: rotor height over a surface beyond which nothing is lost at its end; the flights show it up to 0.12
LEAVING_FADE_M = 0.2
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


@jit
def lifting_thrust(s, i, mean_thrust, joint):
    """Thrust, N, that the mean lift of rotor i multiplies: its own (joint 0), the mean of all (1), or between them."""
    return s[at.THRUST + i] + joint * (mean_thrust - s[at.THRUST + i])


@jit
def leaving(s, memory):
    """Thrust, N, times how far the drone is half beyond the end of a surface that was below all of it (0 to 1)."""
    far = 0.0
    for i in range(4):
        far = max(far, s[at.LOWER_HEIGHT + i])
    share, height, thrust, over = 0.0, 0.0, 0.0, 0.0
    for i in range(4):
        thrust += s[at.THRUST + i]
        cover, near = s[at.COVER + i], s[at.UPPER_HEIGHT + i]
        if cover <= 0.0 and s[at.LOWER_HEIGHT + i] < 0.5 * far:
            cover, near = 1.0, s[at.LOWER_HEIGHT + i]
        if cover > 0.0:
            share, height, over = share + 0.25 * cover, height + near, over + 1.0
    if over == 0.0:
        memory[WHOLE] = far
        return 0.0
    if memory[WHOLE] > 0.5 * far:
        return 0.0
    return thrust * 4.0 * share * (1.0 - share) * math.exp(-(height / over / LEAVING_FADE_M) ** 2)


@wrench
def ground_effect(p, s, memory, generator, out):
    if memory[STEP] != s[at.STEP]:
        memory[STEP], memory[DECAY] = s[at.STEP], math.exp(-s[at.STEP] / p[TURBULENCE_TIME])
        memory[FRESH] = math.sqrt(1.0 - memory[DECAY] ** 2)
    decay, fresh = memory[DECAY], memory[FRESH]
    for i in range(4):
        memory[i] = decay * memory[i] + fresh * normal(generator)
    # the four draws as modes: all alike, left against right, rear against front, one diagonal against the other
    alike = p[HEAVE] * 0.25 * (memory[0] + memory[1] + memory[2] + memory[3])
    left = 0.25 * (memory[2] + memory[3] - memory[0] - memory[1])
    rear = p[PITCH] * 0.25 * (memory[1] + memory[2] - memory[0] - memory[3])
    cross = 0.25 * (memory[0] + memory[2] - memory[1] - memory[3])
    radius, spacing = s[at.ROTOR_RADIUS], s[at.ROTOR_SPACING]
    mean_thrust = 0.25 * (s[at.THRUST] + s[at.THRUST + 1] + s[at.THRUST + 2] + s[at.THRUST + 3])
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
        memory[LIFT + i] = lift
        spin = 1.0 if i % 2 == 0 else -1.0
        draw = alike + (left if i >= 2 else -left) + (rear if i == 1 or i == 2 else -rear) + spin * cross
        unsteady = p[STRENGTH] * s[at.THRUST + i] * p[TURBULENCE] * rough * draw
        force = p[STRENGTH] * lifting_thrust(s, i, mean_thrust, p[JOINT]) * lift + unsteady
        out[2] += force
        out[3] += s[at.ROTOR_Y + i] * force
        out[4] -= s[at.ROTOR_X + i] * force
        out[5] -= p[SWIRL] * spin * unsteady
    if p[EVEN] > 0.0:
        shared = 0.25 * (memory[LIFT] + memory[LIFT + 1] + memory[LIFT + 2] + memory[LIFT + 3])
        for i in range(4):
            force = p[STRENGTH] * lifting_thrust(s, i, mean_thrust, p[JOINT]) * p[EVEN] * (shared - memory[LIFT + i])
            out[2] += force
            out[3] += s[at.ROTOR_Y + i] * force
            out[4] -= s[at.ROTOR_X + i] * force
    if p[LEAVING] != 0.0:
        out[2] -= p[STRENGTH] * p[LEAVING] * leaving(s, memory)


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
     Parameter("turbulence_time", "s", 0.02, 0.002, 1.0, None, "correlation time of the turbulence",
               "rotor radius over wake speed, x 3"),
     Parameter("heave", "1", 1.0, 0.0, 2.0, None,
               "unsteady lift that all rotors share, over that of four independent rotors"),
     Parameter("pitch", "1", 1.0, 0.0, 2.0, None,
               "unsteady lift of front against rear, over that of four independent rotors; below 1 the rotors of one "
               "side share streaks of air"),
     Parameter("swirl", "m", 0.0, 0.0, 0.2, 0.0, "unsteady yaw torque over unsteady lift of a rotor",
               "authors' passes over a platform: about 0.01; neural-swarm's flights over a wide floor: none"),
     Parameter("even", "1", 0.0, 0.0, 1.0, None,
               "how far the rotors share their mean lift evenly; 1: no pitch moment where an edge covers some of them",
               "at exits the authors' flights pitch the other way than a partly covered drone should"),
     Parameter("leaving", "1", 0.0, -0.2, 0.2, 0.0,
               "fraction of the thrust lost when the drone is half beyond the surface's end",
               "authors' flights: 0.2 m/s^2 downwards at exits that no thrust explains, none at entries; cause not "
               "known"),
     Parameter("joint", "1", 0.0, 0.0, 1.0, None,
               "how far the mean lift of each rotor follows the thrust of all, not its own; 1: a moment of the motors "
               "is not amplified near a surface",
               "`tools/diagnosis/gap_lift.py --by-channel`: neural-swarm's roll torque of 2 to 6 Hz shows less than "
               "their lift")),
    wrench=ground_effect,
    presets={
        # lift against height of neural-swarm's flights (Shi et al. 2020), rotors 0.029 m over the floor when
        # standing; rms 0.43 and 0.42 % of weight between 1 and 9 cm (tests/simulation/test_ground_presets.py)
        "crazyflie-34g": {"strength": 1.45, "fade": 0.0875},
        "frame-67g": {"strength": 0.95, "fade": 0.129}})
