"""Random numbers of one flight: counter-based generators that depend on nothing but their key.

The motors, the IMU, the other sensors, the start and each effect own a generator each, so that switching an effect
that adds a force on or off changes nothing that others draw. Down range and optical flow share one, and so do slow and
fast motor noise: another period of the one, or the fast noise switched on, shifts what the other draws.

Source: Steele, Lea, Flood, Fast Splittable Pseudorandom Number Generators, OOPSLA 2014 (SplitMix64); Marsaglia, Tsang,
The Ziggurat Method for Generating Random Variables, 2000.
"""

import functools
import math
import zlib

import numpy as np
from numba import float64, types, uint64

from airtouch.simulation.compiled import jit

GENERATOR = uint64[::1]  #: type of a generator's state, one 64-bit counter
_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_MIX_1 = np.uint64(0xBF58476D1CE4E5B9)
_MIX_2 = np.uint64(0x94D049BB133111EB)
_S30, _S27, _S31, _S11 = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(11)
_TO_UNIT = 1.0 / (1 << 53)
_STRIP, _SIGN = np.uint64(127), np.uint64(128)
_TAIL, _AREA = 3.442619855899, 9.91256303526217e-3  #: start of the tail; area of each strip


def _edges() -> np.ndarray:
    """Right edges of the strips under exp(-x^2 / 2), widest first, 0 last."""
    edges = [_AREA / math.exp(-0.5 * _TAIL**2), _TAIL]
    while len(edges) < 128:
        x = edges[-1]
        edges.append(math.sqrt(-2.0 * math.log(_AREA / x + math.exp(-0.5 * x * x))))
    return np.array([*edges, 0.0])


_EDGE = _edges()
_HEIGHT = np.exp(-0.5 * _EDGE**2)


def generator(seed: int, flight: int, name: str) -> np.ndarray:
    """The state (1,) uint64 of the generator `name` of a flight."""
    return np.array([_begin(seed, flight, name)])


@functools.lru_cache(512)
def _begin(seed: int, flight: int, name: str) -> np.uint64:
    return np.random.SeedSequence([seed, flight, zlib.crc32(name.encode())]).generate_state(1, np.uint64)[0]


@jit(float64(GENERATOR))
def uniform(state):
    """One number in (0, 1]."""
    state[0] += _GOLDEN
    z = state[0]
    z = (z ^ (z >> _S30)) * _MIX_1
    z = (z ^ (z >> _S27)) * _MIX_2
    z = z ^ (z >> _S31)
    return (float(z >> _S11) + 1.0) * _TO_UNIT


@jit(float64(GENERATOR))
def normal(state):
    """One number of the standard normal distribution (ziggurat of 128 strips)."""
    while True:
        state[0] += _GOLDEN
        z = state[0]
        z = (z ^ (z >> _S30)) * _MIX_1
        z = (z ^ (z >> _S27)) * _MIX_2
        z = z ^ (z >> _S31)
        strip = int(z & _STRIP)
        x = float(z >> _S11) * _TO_UNIT * _EDGE[strip]
        sign = 1.0 if z & _SIGN else -1.0
        if x < _EDGE[strip + 1]:
            return sign * x
        if strip == 0:
            while True:
                beyond = -math.log(uniform(state)) / _TAIL
                if -2.0 * math.log(uniform(state)) >= beyond * beyond:
                    return sign * (_TAIL + beyond)
        low, high = _HEIGHT[strip], _HEIGHT[strip + 1]
        if low + (high - low) * uniform(state) < math.exp(-0.5 * x * x):
            return sign * x


@jit(types.void(GENERATOR, float64[::1]))
def normals(state, out):
    """Fill `out` with standard normal numbers."""
    for i in range(len(out)):
        out[i] = normal(state)
