"""Second-order low-pass filters and delay lines."""

import math

from airtouch.simulation.compiled import jit


@jit
def lowpass_coefficients(cutoff, h, out):
    """Second-order Butterworth (b0, b1, b2, a1, a2) for samples of h s into out (5,); cutoff (Hz) 0: no filter."""
    if cutoff <= 0.0 or cutoff >= 0.49 / h:
        out[0], out[1], out[2], out[3], out[4] = 1.0, 0.0, 0.0, 0.0, 0.0
        return
    f = math.tan(math.pi * cutoff * h)
    c = 1.0 + math.sqrt(2.0) * f + f * f
    out[0] = f * f / c
    out[1] = 2.0 * out[0]
    out[2] = out[0]
    out[3] = 2.0 * (f * f - 1.0) / c
    out[4] = (1.0 - math.sqrt(2.0) * f + f * f) / c


@jit
def lowpass(b, memory, x):
    """One sample through the filter with coefficients b (5,); memory (2,) is the filter's own."""
    d = x - memory[0] * b[3] - memory[1] * b[4]
    y = d * b[0] + memory[0] * b[1] + memory[1] * b[2]
    memory[1] = memory[0]
    memory[0] = d
    return y


@jit
def settle(b, memory, level):
    """Set the memory as if the input had always been `level`."""
    d = level / (1.0 + b[3] + b[4])
    memory[0] = d
    memory[1] = d


@jit
def noise_gain(b):
    """rms of the filter's output for white noise of rms 1."""
    d1, d2, total = 0.0, 0.0, 0.0
    for i in range(2000):
        d = (1.0 if i == 0 else 0.0) - d1 * b[3] - d2 * b[4]
        y = d * b[0] + d1 * b[1] + d2 * b[2]
        d2, d1 = d1, d
        total += y * y
    return math.sqrt(total)


@jit
def delayed(ring, at, steps, column):
    """Value of `column`, `steps` (any real number >= 0) rows before row `at`.

    ring (rows, columns): the delay line, whose number of rows is a power of two; row k is kept at k modulo rows.
    """
    whole = int(steps)
    part = steps - whole
    mask = ring.shape[0] - 1
    now = ring[(at - whole) & mask, column]
    if part == 0.0:
        return now
    return now + part * (ring[(at - whole - 1) & mask, column] - now)
