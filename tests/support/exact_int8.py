"""The int8 arithmetic in whole numbers and fractions, one value at a time: the truth for every vectorised form."""

import math
from collections.abc import Iterable
from fractions import Fraction

import numpy as np

from airtouch.reference.networks.int8_network import Int8Layer


def requantised(accumulator: int, multiplier: int, shift: int, zero_point: int, low: int = -128,
                high: int = 127) -> int:
    """Left shift, product over 2^31 with ties up, right shift with ties away from zero, zero point, clamp."""
    product = math.floor(Fraction((accumulator << max(shift, 0)) * multiplier, 2**31) + Fraction(1, 2))
    away = math.floor(abs(Fraction(product, 2 ** max(-shift, 0))) + Fraction(1, 2))
    return max(low, min(high, (-away if product < 0 else away) + zero_point))


def multiplier_of(real: float) -> tuple[int, int]:
    """Mantissa of 31 bits and exponent of a positive real number."""
    exponent = math.floor(math.log2(real)) + 1
    while Fraction(real) >= Fraction(2) ** exponent:
        exponent += 1
    while Fraction(real) < Fraction(2) ** (exponent - 1):
        exponent -= 1
    mantissa = math.floor(Fraction(real) / Fraction(2) ** exponent * 2**31 + Fraction(1, 2))
    return (mantissa // 2, exponent + 1) if mantissa == 2**31 else (mantissa, exponent)


def output(layer: Int8Layer, channel: int, inputs: Iterable[int]) -> int:
    """One activation of a layer with weights, from the inputs of that output in the weights' order."""
    weights = [int(w) for w in np.ravel(layer.weights[channel])]
    total = int(layer.bias[channel]) + sum(
        (int(x) - layer.input_zero_point) * w for x, w in zip(inputs, weights, strict=True))
    scale = float(np.float64(np.float32(layer.input_scale)) * np.float64(layer.weight_scale[channel])
                  / np.float64(np.float32(layer.output_scale)))
    return requantised(total, *multiplier_of(scale), layer.output_zero_point, layer.output_min)
