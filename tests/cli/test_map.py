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
    repeat = run(tmp_path / "zigzag.csv", "--truth", "--out", tmp_path / "map.geojson")
    assert repeat.exit_code != 0 and "--force" in str(repeat.exception)


def test_a_flight_without_an_edge_says_so(tmp_path):
    level = zigzag_log()
    logs.write(level.with_columns({"zrange_m": np.full(len(level), 0.8)}), tmp_path / "level.csv")
    result = run(tmp_path / "level.csv", "--truth", "--out", tmp_path / "map.geojson")
    assert result.exit_code == 0 and result.output.splitlines()[-2] == "no edges found in the down range"


@pytest.mark.parametrize(("ending", "first"), [("png", b"\x89PNG"), ("svg", b"<?xml"), ("pdf", b"%PDF-"),
                                               ("SVG", b"<?xml")])
def test_named_as_the_picture_the_geojson_goes_beside_it(tmp_path, ending, first):
    """Both have a file: written to one name, the picture would replace the GeoJSON without a word."""
    logs.write(zigzag_log(), tmp_path / "zigzag.csv")
    result = run(tmp_path / "zigzag.csv", "--truth", "--out", tmp_path / f"plane.{ending}")
    assert result.exit_code == 0, result.output
    assert json.loads((tmp_path / "plane.geojson").read_text())["features"]
    assert (tmp_path / f"plane.{ending}").read_bytes().startswith(first)
    assert {p.name for p in tmp_path.iterdir()} == {"zigzag.csv", "plane.geojson", f"plane.{ending}"}


def test_edges_at_which_the_position_is_lost_are_counted(tmp_path):
    log = zigzag_log()
    log.columns["x_m"][2200:2500] = np.nan  # both edges of one row
    logs.write(log, tmp_path / "zigzag.csv")
    complete = len(logs.true_edges(log))
    lost = sum(2200 <= edge.sample < 2500 for edge in logs.true_edges(log))
    result = run(tmp_path / "zigzag.csv", "--truth", "--out", tmp_path / "map.geojson")
    assert result.exit_code == 0, result.output
    assert lost and f"left out: {lost} of {complete} edges" in result.output
    content = json.loads((tmp_path / "map.geojson").read_text())
    assert content["properties"]["edges_without_position"] == lost
    assert sum(f["properties"]["role"] == "edge" for f in content["features"]) == complete - lost


def test_columns_without_a_position_are_as_none(tmp_path):
    log = zigzag_log()
    empty = {"x_m": np.full(len(log), np.nan), "y_m": np.full(len(log), np.nan)}
    logs.write(log.with_columns(empty), tmp_path / "empty.csv")
    logs.write(zigzag_log(with_position=False), tmp_path / "without.csv")
    assert "--speed" in str(run(tmp_path / "empty.csv", "--truth", "--out", tmp_path / "none.geojson").exception)
    features = []
    for name in ("empty", "without"):
        result = run(tmp_path / f"{name}.csv", "--truth", "--speed", "0.3", "--out", tmp_path / f"{name}.geojson")
        assert result.exit_code == 0, result.output
        features.append(json.loads((tmp_path / f"{name}.geojson").read_text())["features"])
    assert features[0] == features[1] and len(features[0]) > 2


@pytest.mark.parametrize(("every", "placed"), [(10, True), (25, True), (40, False)])
def test_positions_of_a_slower_sensor_place_the_edges_up_to_a_quarter_of_a_second_apart(tmp_path, every, placed):
    log = zigzag_log()
    sparse = np.arange(len(log)) % every != 3
    logs.write(log.with_columns({name: np.where(sparse, np.nan, log[name]) for name in ("x_m", "y_m")}),
               tmp_path / "slow.csv")
    result = run(tmp_path / "slow.csv", "--truth", "--out", tmp_path / "map.geojson")
    if not placed:
        assert "no position (x_m, y_m) at any of the" in str(result.exception)
        assert not (tmp_path / "map.geojson").exists()
        return
    features = json.loads((tmp_path / "map.geojson").read_text())["features"]
    at = np.array([f["geometry"]["coordinates"] for f in features if f["properties"]["role"] == "edge"])
    assert len(at) == len(logs.true_edges(log))
    assert np.abs(np.abs(at[:, 0]) - 0.4).max() < 0.01  # the square's sides


def test_without_position_the_edges_lie_along_the_track(tmp_path):
    logs.write(zigzag_log(with_position=False), tmp_path / "zigzag.csv")
    result = run(tmp_path / "zigzag.csv", "--truth", "--out", tmp_path / "map.geojson")
    assert result.exit_code != 0 and "--speed" in str(result.exception)
    result = run(tmp_path / "zigzag.csv", "--truth", "--speed", "0.3", "--out", tmp_path / "map.geojson")
    assert result.exit_code == 0, result.output
    points = [f for f in json.loads((tmp_path / "map.geojson").read_text())["features"]
              if f["properties"]["role"] == "edge"]
    assert points[1]["geometry"]["coordinates"][0] == pytest.approx(0.8, abs=0.02)


def test_the_picture_is_a_map_platform_scale_start_and_end():
    from shapely.geometry import Point

    from airtouch.detector.evaluation.edge_map import EdgeMap, EdgePoint, Platform
    from airtouch.report import map_figure

    xy = np.column_stack([np.linspace(-2.0, 3.0, 500), np.zeros(500)])
    points = [EdgePoint(200, 2.0, "entry", 0.0, 0.0, 0.02), EdgePoint(300, 3.0, "exit", 1.0, 0.0, 0.02)]
    one_pass = Platform(Point(0.0, 0.0), Point(1.0, 0.0), None, None, 0.02)
    figure = map_figure.edge_map(EdgeMap(xy, points, [one_pass], "logged", 0.0, 0.1), "a flight")
    (ax,) = figure.axes
    labels = {text.get_text() for text in figure.legends[0].get_texts()}
    assert {"start", "end", "track", "platform (its width is not known)", "entry (1)", "exit (1)"} <= labels
    (strip,) = ax.patches
    corners = strip.get_xy()
    assert corners[:, 0].min() == 0.0 and corners[:, 0].max() == 1.0
    assert np.ptp(corners[:, 1]) == pytest.approx(map_figure.STRIP_M)
    bar = ax.lines[-1].get_xydata()
    ends = ax.transAxes.inverted().transform(ax.transData.transform(bar))
    assert (ends > 0.0).all() and (ends[:, 1] < 0.2).all() and ends[1, 0] < 0.5  # at the lower left
    assert [t.get_text() for t in ax.texts if t.get_text()] == [f"{bar[1, 0] - bar[0, 0]:g} m"]


def test_the_scale_bar_covers_nothing_of_a_flight_that_begins_at_the_lower_left():
    from airtouch.detector.evaluation.edge_map import EdgeMap
    from airtouch.report import map_figure

    for turn in (0.0, 0.5, 1.0):
        along = np.linspace(0.0, 3.0, 500)
        xy = np.column_stack([along * np.cos(turn), along * np.sin(turn)])
        (ax,) = map_figure.edge_map(EdgeMap(xy, [], [], "logged", 0.0, 0.1), "a flight").axes
        (text,) = [t for t in ax.texts if t.get_text()]
        top = ax.transData.inverted().transform(text.get_window_extent())[1, 1]
        assert max(top, ax.lines[-1].get_ydata().max()) < xy[:, 1].min()


@pytest.mark.parametrize("limits", [(1.0, 1.6), (1.6, 1.0), (-5.0, 30.0), (0.0, 0.4)])
def test_the_scale_bar_stays_in_a_map_with_other_limits_and_is_as_long_as_it_says(limits):
    from airtouch.detector.evaluation.edge_map import EdgeMap
    from airtouch.report import map_figure

    xy = np.column_stack([np.linspace(0.0, 3.0, 500), np.zeros(500)])
    figure = map_figure.edge_map(EdgeMap(xy, [], [], "logged", 0.0, 0.1), "a flight")
    (ax,) = figure.axes
    ax.set(xlim=limits, ylim=np.subtract(limits, 1.0))
    figure.set_size_inches(3.3, 2.5)
    figure.draw_without_rendering()
    (text,) = [t for t in ax.texts if t.get_text()]
    ends = ax.lines[-1].get_xydata()
    assert abs(ends[1, 0] - ends[0, 0]) == pytest.approx(float(text.get_text().removesuffix(" m")))
    places = ax.transAxes.inverted().transform(ax.transData.transform([*ends, text.xy]))
    assert (places >= 0.0).all() and (places <= 0.6).all() and places[1, 0] > places[0, 0]
    assert ax.get_xlim() == pytest.approx(limits) and ax.get_ylim() == pytest.approx(np.subtract(limits, 1.0))
    width_px = 3.0 * figure.dpi / 72.0  # of the bar
    assert text.get_window_extent().y0 > ax.transData.transform(ends)[0, 1] + 0.5 * width_px


def test_the_band_of_an_outline_is_named_in_the_legend_and_reaches_two_sigma_beyond_it():
    """A platform of 1 by 1 m, known to 0.05 m."""
    from shapely.geometry import LineString, box

    from airtouch.detector.evaluation.edge_map import EdgeMap, Platform
    from airtouch.report import map_figure

    xy = np.column_stack([np.linspace(-2.0, 3.0, 500), np.full(500, 0.5)])
    sides = (LineString([(x, 0.0), (x, 1.0)]) for x in (0.0, 1.0))
    square = Platform(*sides, box(0.0, 0.0, 1.0, 1.0), None, 0.05)
    figure = map_figure.edge_map(EdgeMap(xy, [], [square], "logged", 0.0, 0.1), "a flight")
    (band,) = (patch for patch in figure.axes[0].patches if "2 sigma" in patch.get_label())
    assert band.get_label() in {text.get_text() for text in figure.legends[0].get_texts()}
    corners = band.get_path().vertices
    assert (corners[:, 0].min(), corners[:, 0].max()) == pytest.approx((-0.1, 1.1))
