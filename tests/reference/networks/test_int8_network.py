"""The int8 network against whole numbers and fractions, one value at a time (`exact_int8`)."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import exact_int8
from airtouch.reference.networks.int8_network import (
    CONV,
    DENSE,
    MAX_POOL,
    Int8Layer,
    Int8Network,
    infer_int8,
    quantise,
    quantised_multiplier,
    requantise,
    run,
    runs_sparse,
    sparse_blocks,
)


def layer(kind, shape_in, shape_out, kernel, rng, *, relu, output_zero_point, outputs_scale=0.05) -> Int8Layer:
    """A layer of random weights; about a third of its activations leave the range."""
    shape = (shape_out[2], *kernel, shape_in[2]) if kind is CONV else (shape_out[2], int(np.prod(shape_in)))
    inputs = int(np.prod(shape[1:]))
    return Int8Layer(kind, shape_in, shape_out, kernel, 0.02, -7, outputs_scale, output_zero_point, relu,
                     rng.integers(-127, 128, shape).astype(np.int8), rng.integers(-900, 900, shape[0]).astype(np.int32),
                     (0.03 / np.sqrt(inputs) * rng.uniform(0.5, 2.0, shape[0])).astype(np.float32))


# rounding


def test_quantise_rounds_half_up_and_clamps():
    x = np.array([0.0, 0.049, 0.05, -0.05, -0.051, 0.15, 1.0, 12.3, 12.4, -13.1, -13.2, 1e30, -1e30, np.inf, -np.inf])
    quantised = quantise(x.astype(np.float32), 0.125, 3)
    assert quantised.dtype == np.int8
    by_hand = [3, 3, 3, 3, 3, 4, 11, 101, 102, -102, -103, 127, -128, 127, -128]
    assert quantised.tolist() == by_hand


def test_quantise_takes_ties_up_and_nan_as_zero():
    assert quantise(np.array([0.25, 0.75, -0.25, -0.75]), 0.5, 0).tolist() == [1, 2, 0, -1]
    assert quantise(np.array([np.nan, 0.0]), 0.5, -9).tolist() == [-9, -9]
    assert quantise(np.array([-64.0, 63.5, 63.75, -64.25]), 0.5, 0).tolist() == [-128, 127, 127, -128]


def test_quantise_computes_in_float32():
    x = np.nextafter(np.float64(0.25), 0.0)  # just below a tie in float64, the tie itself in float32
    assert quantise(np.array([x]), 0.5, 0).tolist() == [1]


@pytest.mark.parametrize("real", [1.0 - 2.0**-40, 1.0, 0.5, 2.0**-31, 2.0**-32, 1.5 * 2.0**-32, 3.0, 100.0, 1e-3])
def test_a_multiplier_has_31_bits(real):
    mantissa, exponent = quantised_multiplier(np.array([real]))
    assert (mantissa.dtype, exponent.dtype) == (np.int32, np.int8)
    assert (int(mantissa[0]), int(exponent[0])) == exact_int8.multiplier_of(real)


def test_a_multiplier_too_small_to_shift_by_is_zero():
    mantissa, exponent = quantised_multiplier(np.array([2.0**-33, 2.0**-60, 2.0**-32]))
    assert mantissa.tolist() == [0, 0, 2**30] and exponent.tolist() == [0, 0, -31]
    assert quantised_multiplier(np.array([1, 2]))[0].tolist() == [2**30, 2**30]  # whole numbers are taken too


@settings(max_examples=300, deadline=None)
@given(st.integers(-2**24, 2**24), st.integers(2**30, 2**31 - 1), st.integers(-31, 4), st.integers(-128, 127),
       st.booleans())
def test_requantise_is_exact(accumulator, multiplier, shift, zero_point, relu):
    low = zero_point if relu else -128
    outputs = requantise(np.array([accumulator], np.int32), np.array([multiplier], np.int32),
                         np.array([shift], np.int8), zero_point, low)
    assert outputs.dtype == np.int8
    assert outputs.tolist() == [exact_int8.requantised(accumulator, multiplier, shift, zero_point, low)]


def test_requantise_shifts_to_the_left_before_it_multiplies():
    # 3 * 2^2 * 0.75 = 9; the other way round 3 * 0.75 is 2 and a half, rounded, times 4
    assert requantise(np.array([3]), np.array([3 * 2**29]), np.array([2]), 0).tolist() == [9]
    assert requantise(np.array([0, 300, -300]), np.array([2**30]), np.array([1]), 5, -20, 40).tolist() == [5, 40, -20]


# layers


@pytest.mark.parametrize(("relu", "zero_point"), [(False, 12), (True, -128), (True, -20)])
def test_a_convolution_is_its_sums(relu, zero_point):
    rng = np.random.default_rng(1)
    convolution = layer(CONV, (5, 4, 2), (4, 2, 3), (2, 3), rng, relu=relu, output_zero_point=zero_point)
    x = rng.integers(-128, 128, (3, 5, 4, 2)).astype(np.int8)
    outputs = run(Int8Network((convolution,)), x).reshape(3, 4, 2, 3)
    for n, row, column, channel in product(range(3), range(4), range(2), range(3)):
        patch = x[n, row:row + 2, column:column + 3].ravel()
        assert outputs[n, row, column, channel] == exact_int8.output(convolution, channel, patch)
    assert outputs.min() == convolution.output_min and len(np.unique(outputs)) > 20


@pytest.mark.parametrize(("relu", "zero_point"), [(False, 3), (True, -128), (True, 40)])
def test_a_dense_layer_is_its_sums(relu, zero_point):
    rng = np.random.default_rng(2)
    dense = layer(DENSE, (2, 3, 4), (1, 1, 5), (1, 1), rng, relu=relu, output_zero_point=zero_point)
    x = rng.integers(-128, 128, (40, 24)).astype(np.int8)
    outputs = run(Int8Network((dense,)), x)
    assert outputs.dtype == np.int8
    assert outputs.tolist() == [[exact_int8.output(dense, channel, row) for channel in range(5)] for row in x]


def test_a_pool_is_the_largest_of_its_block_and_drops_what_is_left_over():
    pool = Int8Layer(MAX_POOL, (5, 5, 2), (2, 1, 2), (2, 3), 0.1, 0, 0.1, 0)
    x = np.random.default_rng(3).integers(-128, 128, (4, 5, 5, 2)).astype(np.int8)
    outputs = run(Int8Network((pool,)), x).reshape(4, 2, 1, 2)
    for n, row, channel in product(range(4), range(2), range(2)):
        block = [int(x[n, 2 * row + i, j, channel]) for i in range(2) for j in range(3)]
        assert outputs[n, row, 0, channel] == max(block)


def test_layers_follow_one_another_and_windows_do_not_mix():
    rng = np.random.default_rng(4)
    conv = layer(CONV, (7, 1, 1), (6, 1, 4), (2, 1), rng, relu=True, output_zero_point=-128)
    pool = Int8Layer(MAX_POOL, (6, 1, 4), (3, 1, 4), (2, 1), 0.05, -128, 0.05, -128)
    head = layer(DENSE, (3, 1, 4), (1, 1, 2), (1, 1), rng, relu=False, output_zero_point=5)
    network = Int8Network((conv, pool, head))
    assert network.input_shape == (7, 1, 1) and network.outputs == 2
    x = rng.integers(-128, 128, (600, 7)).astype(np.int8)  # more than are computed at a time
    by_layer = x
    for single in network.layers:
        by_layer = run(Int8Network((single,)), by_layer)
    np.testing.assert_array_equal(run(network, x), by_layer)
    np.testing.assert_array_equal(run(network, x[300:301]), by_layer[300:301])


def test_no_window_gives_no_row():
    rng = np.random.default_rng(5)
    network = Int8Network((layer(DENSE, (2, 1, 2), (1, 1, 3), (1, 1), rng, relu=False, output_zero_point=0),))
    nothing = run(network, np.zeros((0, 4), np.int8))
    assert nothing.shape == (0, 3) and nothing.dtype == np.int8
    window = np.array([[1, 2, 3, 4]])
    np.testing.assert_array_equal(run(network, window), run(network, window.astype(np.int8)))


def test_float_windows_are_quantised_as_the_first_layer_says():
    rng = np.random.default_rng(6)
    first = layer(DENSE, (3, 1, 2), (1, 1, 4), (1, 1), rng, relu=True, output_zero_point=-128)
    first = replace(first, input_scale=0.04)
    head = layer(DENSE, (1, 1, 4), (1, 1, 2), (1, 1), rng, relu=False, output_zero_point=1)
    windows = rng.normal(size=(30, 3, 2)).astype(np.float32)
    expected = run(Int8Network((first, head)), quantise(windows, 0.04, -7))
    np.testing.assert_array_equal(infer_int8(Int8Network((first, head)), windows), expected)
    assert len(np.unique(expected, axis=0)) > 10


# what the C kernels take


@pytest.mark.parametrize("relu", [False, True])
def test_c_constants_give_the_layers_outputs(relu):
    rng = np.random.default_rng(7)
    dense = layer(DENSE, (4, 1, 3), (1, 1, 6), (1, 1), rng, relu=relu, output_zero_point=-30)
    weights = dense.weights.copy()
    weights[[1, 4]] = 0  # pruning took these outputs
    scale = dense.weight_scale.copy()
    scale[[1, 4]] = 1e-20
    bias = dense.bias.copy()
    bias[[1, 4]] = 2**31 - 1, -2**31
    dense = replace(dense, weights=weights, weight_scale=scale, bias=bias)
    c_bias, multiplier, shift = dense.c_constants()
    assert (c_bias.dtype, multiplier.dtype, shift.dtype) == (np.int32, np.int32, np.int8)
    x = rng.integers(-128, 128, (50, 12)).astype(np.int8)
    for row, expected in zip(x, run(Int8Network((dense,)), x), strict=True):
        sums = [int(c_bias[o]) + sum(int(a) * int(w) for a, w in zip(row, weights[o], strict=True)) for o in range(6)]
        outputs = [exact_int8.requantised(s, int(multiplier[o]), int(shift[o]), -30, dense.output_min)
                   for o, s in enumerate(sums)]
        assert outputs == expected.tolist()
    assert multiplier[[1, 4]].tolist() == [2**30] * 2 and shift[[1, 4]].tolist() == [1, 1]


def test_an_output_without_weights_is_its_clamped_constant():
    dense = Int8Layer(DENSE, (1, 1, 4), (1, 1, 3), (1, 1), 0.1, 0, 0.1, 20, True,
                      np.array([[0] * 4, [0] * 4, [1] * 4], np.int8), np.array([-500, 500, 500], np.int32),
                      np.array([0.5, 0.5, 0.5], np.float32))
    bias, multiplier, shift = dense.c_constants()
    assert (bias[:2] + 20).tolist() == [20, 127]  # clamped by the ReLU and by int8
    assert bias[2] == 500 and (int(multiplier[2]), int(shift[2])) == exact_int8.multiplier_of(0.5)


def test_a_gap_of_more_than_255_blocks_is_bridged_by_zeros():
    for gap, skips in ((255, [255]), (256, [255, 0]), (257, [255, 1]), (512, [255, 255, 0])):
        weights = np.zeros((1, 4 * 600), np.int8)
        weights[0, 4 * gap + 1] = 9
        blocks, counts, block_offsets = sparse_blocks(weights)
        assert (blocks.dtype, counts.dtype, block_offsets.dtype) == (np.int8, np.uint16, np.uint8)
        assert block_offsets.tolist() == skips and counts.tolist() == [len(skips)]
        assert blocks.tolist() == [[0, 0, 0, 0]] * (len(skips) - 1) + [[0, 9, 0, 0]]


def test_an_output_without_blocks_counts_none():
    blocks, counts, skips = sparse_blocks(np.zeros((3, 8), np.int8))
    assert blocks.shape == (0, 4) and counts.tolist() == [0, 0, 0] and skips.shape == (0,)


def test_weights_go_in_blocks_where_these_take_fewer_bytes():
    """Five bytes a block and two an output, against one a weight."""
    def dense(nonzero: int, size: int = 28, kind=DENSE) -> Int8Layer:
        weights = np.zeros((1, size), np.int8)
        weights[0, :4 * nonzero:4] = 1
        return Int8Layer(kind, (1, 1, size), (1, 1, 1), (1, 1), 0.1, 0, 0.1, 0, weights=weights)

    assert [runs_sparse(dense(nonzero)) for nonzero in (0, 4, 5, 6)] == [True, True, True, False]  # 2, 22, 27, 32 of 28
    assert not runs_sparse(dense(2, size=12)) and runs_sparse(dense(1, size=12))  # 12 of 12, 7 of 12
    assert not runs_sparse(dense(0, size=6))  # not in blocks of four
    assert not runs_sparse(replace(dense(0), kind=replace(DENSE, sparse_number=None)))
    assert not runs_sparse(Int8Layer(MAX_POOL, (2, 1, 4), (1, 1, 4), (2, 1), 0.1, 0, 0.1, 0))
    assert not runs_sparse(replace(dense(0), weights=np.zeros((0, 28), np.int8)))
