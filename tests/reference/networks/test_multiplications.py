"""Multiplications of int8 networks, counted by hand."""

import numpy as np
import pytest

from airtouch.reference.networks.int8_network import (
    CONV,
    DENSE,
    MAX_POOL,
    Int8Layer,
    Int8Network,
    multiplications,
    rolling_multiplications,
)

NO_WEIGHTS = np.zeros(0, np.int8)


def layer(kind, shape_in, shape_out, kernel=(1, 1), weights=NO_WEIGHTS):
    return Int8Layer(kind, shape_in, shape_out, kernel, 0.1, 0, 0.1, 0, weights=weights)


def ones(*shape):
    return np.ones(shape, np.int8)


def test_an_inference_computes_no_position_that_a_pool_drops():
    network = Int8Network((
        layer(CONV, (11, 3, 1), (9, 3, 4), (3, 1), ones(4, 3, 1, 1)),
        layer(MAX_POOL, (9, 3, 4), (4, 3, 4), (2, 1)),
        layer(CONV, (4, 3, 4), (3, 2, 2), (2, 2), ones(2, 2, 2, 4)),
        layer(DENSE, (1, 1, 12), (1, 1, 2), weights=ones(2, 12))))
    assert multiplications(network) == 8 * 3 * 12 + 3 * 2 * 32 + 24


@pytest.mark.parametrize(("stride", "later"), [(1, 1), (2, 2), (4, 2)])
def test_a_stream_computes_a_row_as_often_as_pools_and_stride_let_it(stride, later):
    network = Int8Network((
        layer(CONV, (11, 3, 1), (9, 3, 4), (3, 1), ones(4, 3, 1, 1)),
        layer(MAX_POOL, (9, 3, 4), (4, 3, 4), (2, 1)),
        layer(CONV, (4, 3, 4), (3, 2, 2), (2, 2), ones(2, 2, 2, 4)),
        layer(DENSE, (1, 1, 12), (1, 1, 2), weights=ones(2, 12))))
    assert rolling_multiplications(network, stride) == 3 * 12 + (2 * 32 + 24) / later


def test_pools_one_behind_another_multiply():
    network = Int8Network((
        layer(MAX_POOL, (8, 1, 1), (4, 1, 1), (2, 1)), layer(MAX_POOL, (4, 1, 1), (1, 1, 1), (4, 1)),
        layer(DENSE, (1, 1, 1), (1, 1, 16), weights=ones(16, 1))))
    assert rolling_multiplications(network, 16) == 16 / 8 and rolling_multiplications(network, 4) == 16 / 4


def test_pruned_layers_skip_empty_blocks_of_four():
    weights = np.zeros((4, 32), np.int8)
    weights[0, 5], weights[2, 8:12] = 1, 3
    network = Int8Network((layer(DENSE, (1, 1, 32), (1, 1, 4), weights=weights),))
    assert multiplications(network) == 2 * 4 == rolling_multiplications(network, 1)
