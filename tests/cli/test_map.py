"""`airtouch map`, from the outside."""

import json

import numpy as np
import pytest
import shapely
from click.testing import CliRunner

from airtouch import logs
from airtouch.cli.map import command
from airtouch.logs.flight_log import FlightLog

pytest.importorskip("shapely")
SQUARE = shapely.box(-0.4, -0.4, 0.4, 0.4)


def zigzag_log(with_position: bool = True) -> FlightLog:
    """A zig-zag at 0.3 m/s over a square platform; motors run, the range steps at its edges."""
    steps = np.arange(-1.0, 1.0, 0.003)
    legs = [np.column_stack((steps if i % 2 == 0 else -steps, np.full(len(steps), y)))
            for i, y in enumerate(np.arange(-0.6, 0.61, 0.1))]
    xy = np.vstack(legs)
    over = shapely.contains_xy(SQUARE, *xy.T)
    columns = {"t_s": np.arange(len(xy)) * 0.01, "zrange_m": np.where(over, 0.05, 0.8)}
    columns |= {f"m{i}_pwm": np.full(len(xy), 47000.0) for i in range(1, 5)}
    if with_position:
        columns |= {"x_m": xy[:, 0], "y_m": xy[:, 1]}
    return FlightLog(columns, {"sample_period_s": 0.01})


def run(*arguments: object):
    return CliRunner().invoke(command, [str(a) for a in arguments])


def test_a_zigzag_gives_the_platform_and_a_picture(tmp_path):
    logs.write(zigzag_log(), tmp_path / "zigzag.csv")
    result = run(tmp_path / "zigzag.csv", "--truth", "--out", tmp_path / "map.geojson")
    assert result.exit_code == 0, result.output
    assert "platform 0" in result.output
    features = json.loads((tmp_path / "map.geojson").read_text())["features"]
    outline = next(shapely.geometry.shape(f["geometry"]) for f in features if f["properties"]["role"] == "outline")
    assert outline.intersection(SQUARE).area / outline.union(SQUARE).area > 0.85
    assert (tmp_path / "map.png").read_bytes().startswith(b"\x89PNG")
    again = run(tmp_path / "zigzag.csv", "--truth", "--out", tmp_path / "map.geojson")
    assert again.exit_code != 0 and "--force" in str(again.exception)


def test_without_position_the_edges_lie_along_the_track(tmp_path):
    logs.write(zigzag_log(with_position=False), tmp_path / "zigzag.csv")
    result = run(tmp_path / "zigzag.csv", "--truth", "--out", tmp_path / "map.geojson")
    assert result.exit_code != 0 and "--speed" in str(result.exception)
    result = run(tmp_path / "zigzag.csv", "--truth", "--speed", "0.3", "--out", tmp_path / "map.geojson")
    assert result.exit_code == 0, result.output
    points = [f for f in json.loads((tmp_path / "map.geojson").read_text())["features"]
              if f["properties"]["role"] == "edge"]
    assert points[1]["geometry"]["coordinates"][0] == pytest.approx(0.8, abs=0.02)
