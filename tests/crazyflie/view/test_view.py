"""Sparklines, maps and boards for a terminal."""

import io

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from airtouch.crazyflie.view.board import SIGNALS, Board, Link, edge_line
from airtouch.crazyflie.view.sparkline import BLOCKS, sparkline, text_map

NUMBERS = st.lists(st.floats(allow_nan=True, allow_infinity=True, width=32), max_size=80)


@given(NUMBERS, st.integers(0, 60))
def test_any_signal_fits_its_width(values, width):
    line = sparkline(values, width, -1.0, 1.0)
    assert len(line) == width and set(line) <= set(BLOCKS + " ")


def test_a_ramp_climbs_and_holes_are_blank():
    assert sparkline(np.arange(8), 8) == BLOCKS
    assert sparkline([0.0, np.nan, 1.0], 3) == f"{BLOCKS[0]} {BLOCKS[-1]}"
    assert sparkline([5.0] * 10, 4) == BLOCKS[0] * 4
    assert sparkline([], 4) == "    " and sparkline([0.0, 9.0], 4, 0.0, 1.0) == "  " + BLOCKS[0] + BLOCKS[-1]


@given(st.lists(st.tuples(st.floats(-50, 50), st.floats(-50, 50)), max_size=50), st.integers(20, 60),
       st.integers(3, 20))
def test_any_track_fits_the_map(track, width, height):
    lines = text_map(np.array(track).reshape(-1, 2), [(0.0, 0.0, "entry")], width, height)
    assert len(lines) == height


def test_edges_lie_where_they_were_felt():
    track = np.column_stack([np.linspace(0, 4, 100), np.zeros(100)])
    row = next(line for line in text_map(track, [(1.0, 0.0, "entry"), (3.0, 0.0, "exit")], 41, 5) if "[" in line)
    assert row.index("[") == 10 and row.index("]") == 30 and row.index("o") == 40 and row[0] == "."


def columns(n):
    c = {f"gyro_{a}_radps": np.zeros(n) for a in "xyz"} | {f"m{i}_pwm": np.full(n, 4e4) for i in range(1, 5)}
    return c | {"acc_z_mps2": np.full(n, 9.81), "zrange_m": np.full(n, 0.8), "vbat_V": np.full(n, 3.9),
                "x_m": np.linspace(0, 1, n), "y_m": np.zeros(n)}


@pytest.mark.parametrize("axis", ["x_m", "y_m"])
def test_a_board_without_one_of_the_two_positions_has_no_track(axis):
    board, values = Board("test", "best"), columns(100)
    del values[axis]
    board.add(np.arange(100) / 100, values, np.zeros(100))
    assert np.isnan(board.add_edge("entry", 0.9, 0.97).x_m)


def test_a_board_places_edges_one_lag_back_and_draws_itself():
    board = Board("test", "best", lag_s=0.5, link=Link(100.0, 0.01, 0.004, 0.002))
    board.add(np.arange(100) / 100, columns(100), np.linspace(0, 1, 100))
    edge = board.add_edge("entry", 0.9, 0.97)
    assert abs(edge.x_m - 0.4) < 0.06
    out = io.StringIO()
    Console(file=out, width=160).print(board.render())
    text = out.getvalue()
    assert all(name in text for name in SIGNALS) and "entry" in text and "1.0 % lost" in text and "[" in text
    assert "P 0.97" in edge_line(edge) and "1.0 s" in board.line() and "1 edges" in board.line()
    board.link.silent_s = 3.0
    assert "SILENT for 3.0 s" in board.line()


def test_the_track_of_a_long_flight_stays_short_and_new_edges_are_placed_as_well():
    board = Board("test", "best", lag_s=0.5)
    for first in range(0, 100_000, 500):  # 1000 s
        times = (first + np.arange(500)) / 100
        board.add(times, columns(500) | {"x_m": times / 10}, np.zeros(500))
    assert len(board._track) <= 2000 and board._track[0][0] == 0.0
    assert abs(board.add_edge("entry", 990.5, 0.97).x_m - 99.0) <= 0.01  # 5 samples at 0.1 m/s
    gaps = np.diff([at for at, *_ in board._track])
    assert gaps.max() < 10.0, "the whole flight is on the map"


def test_an_empty_board_shows_no_value_no_position_and_no_edge():
    out = io.StringIO()
    Console(file=out, width=100).print(Board("test", "best").render())
    text = out.getvalue()
    assert text.count("nan") == len(SIGNALS) and all(name in text for name in SIGNALS)
    assert "no position" in text and "edges (0, best)" in text
