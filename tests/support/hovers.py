"""Made hovers whose truth is known: white noise of the declared sensors, a steady force, and effects selected there."""

from dataclasses import replace

import numpy as np
from scipy.signal import lfilter

from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.fit import fit
from airtouch.gap.evidence.judge import judge
from airtouch.gap.flights.flight import PERIOD_S
from airtouch.gap.naming import judging
from airtouch.gap.naming.select import select
from airtouch.gap.nominal.build_study import declared_study, sensor_noise
from airtouch.gap.signatures.candidates import all_candidates
from airtouch.gap.signatures.scatter import Scatter
from airtouch.simulation import signals
from gap_flights import VEHICLE, flight, noise

ALWAYS = ("wind", "gust", "downwash")  #: left out, so that there are no passing effects
LOUDNESS = np.sqrt(2.0)  #: the floor of a study without flights is twice the declared power
DOWN = 0.5  #: m/s^2, pushed where a test pushes
FLOOR = declared_study(VEHICLE, ())  #: no loop, no calibration, a floor of sensor noise
CORRELATION_S = 0.5  #: of the made gusts, which is that of one of the variants
PWM = 40000.0  #: of the made hovers
LIFT_N = float(VEHICLE.thrust(np.full(1, PWM))[0])  #: of one motor
#: front and left (+1) of each rotor; 1 and 3 turn to the left, and without their drag the vehicle yaws that way
PLACE = {1: (1, -1, 1), 2: (-1, -1, -1), 3: (-1, 1, 1), 4: (1, 1, -1)}
#: a user's effect, as a file
STIFF = '''"""A height loop tuned otherwise: nothing of it is in what the logged commands lead to expect."""
from airtouch.simulation.effects import Effect, Parameter


def settings(plant, v):
    plant["height_gain"] *= v["factor"]


FACTOR = Parameter("factor", "1", 1.5, 0.2, 5.0, 1.0, "of the gain")
EFFECT = Effect("stiff_climb", "gain of the height loop", (FACTOR,), settings=settings)
'''


def hover(seed, force=(0.0, 0.0, 0.0), louder=1.0, length_s=30.0, **options):
    """A hover with white noise `louder` times as strong as the floor has it, and a steady force, m/s^2."""
    declared = sensor_noise(VEHICLE)
    acc, gyro = LOUDNESS * louder * declared[:3], LOUDNESS * louder * declared[3:6]
    return flight(length_s, noise(length_s, 1.0, seed) * acc + np.array(force),
                  noise(length_s, 1.0, seed + 500) * gyro, **options)


def weak(louder=1.0, **losses):
    """A hover in which rotors (`r1` to `r4`) have lost a share of their lift: what is missing turns it, by hand."""
    lost_n = {int(name[1]): share * LIFT_N for name, share in losses.items()}
    flight = hover(11, (0.0, 0.0, -sum(lost_n.values()) / VEHICLE.mass_kg), louder, length_s=20.0)
    arm = VEHICLE.arm_m / np.sqrt(2.0)  # it sinks on that side: x to the front, y to the left, z up
    torque = sum(n * np.array([-left * arm, front * arm, yaw * VEHICLE.yaw_torque_over_thrust_m])
                 for n, (front, left, yaw) in ((n, PLACE[r]) for r, n in lost_n.items()))
    turning = torque / np.array(VEHICLE.inertia_kg_m2)
    return replace(flight, rates=flight.rates + np.arange(len(flight))[:, None] * 0.01 * turning)


def swaying(drag=0.0, gust_mps2=0.0):
    """A flight back and forth at up to 1 m/s, against a drag, N/(m/s), and in gusts of this rms."""
    flight = hover(1)
    speed = np.sin(2.0 * np.pi * 0.4 * 0.01 * np.arange(len(flight)))
    force = -drag * speed[:, None] * [1.0, 0.0, 0.0] / VEHICLE.mass_kg
    decay = np.exp(-0.01 / CORRELATION_S)
    gusts = gust_mps2 * lfilter([np.sqrt(1.0 - decay ** 2)], [1.0, -decay], noise(30.0, 1.0, 10), axis=0)
    motion = flight.signals.copy()
    motion[:, signals.VELOCITY] = speed
    return replace(flight, signals=motion, acceleration=flight.acceleration + force + gusts)


def with_a_push(since_s, until_s, seed=6, mps2=1.0):
    """A hover that something pushes down for some seconds."""
    flight = hover(seed)
    t = np.arange(len(flight)) * PERIOD_S
    force = flight.acceleration.copy()
    force[(t >= since_s) & (t < until_s), 2] -= mps2
    return replace(flight, acceleration=force, name="pushed")


def candidates_of(names):
    return {n: v for n, v in all_candidates().items() if n in names}


def select_from(flights, names, study=FLOOR, without=ALWAYS, progress=lambda _: None):
    data = Data(study, flights)
    return select(data, candidates_of(names), progress, without), data


def scattered(exact=False, **rms):
    """The study with a scatter of nominal flights: recorded ones, or a simulator's with the same models (`exact`)."""
    return FLOOR.with_scatter(Scatter({n: np.array(r) for n, r in rms.items()}, 8.0, (0.0, 0.0), exact=exact))


def own_gain(data, terms, first=None):
    """Held-out log likelihood of effects by the definition: fitted on one half, judged on the other, both ways."""
    total = 0.0
    for train, test in ((0, 1), (1, 0)):
        parts = judging.halves(data)
        start = None if first is None else first[train]
        fitted_terms = fit(data, parts[train], terms, start).terms
        random = any(t.shows_in == "spectrum" for t in fitted_terms)
        total += judge(data, parts[test], fitted_terms) - judge(data, parts[test], (), random)
    return total
