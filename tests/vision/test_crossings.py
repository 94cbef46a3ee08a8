"""Lines, crossings and their fusion on images and flights whose answer is known."""

import numpy as np
import pytest

from airtouch.detector.trace import Detection
from airtouch.errors import AirTouchError
from airtouch.logs.edges import Edge, true_edges
from airtouch.logs.flight_log import FlightLog
from airtouch.vision.camera import Camera
from skips import needs

pytestmark = needs("cv2")
CAMERA = Camera()


@pytest.mark.parametrize(("column", "tilt_deg"), [(100.0, 0.0), (200.5, 9.0), (250.0, -15.0)])
def test_a_straight_edge_is_found_where_it_crosses_the_middle_row(column, tilt_deg):
    from airtouch.vision import lines

    rows, columns = np.mgrid[0:244, 0:324]
    image = np.where(columns > column + np.tan(np.radians(tilt_deg)) * (rows - 121.5), 200, 60).astype(np.uint8)
    image = np.clip(image + np.random.default_rng(4).normal(0, 20, image.shape), 0, 255).astype(np.uint8)
    line = lines.strongest(lines.classical(lines.shrink(image)), CAMERA)
    assert line.column == pytest.approx(column + 0.5, abs=1.0)
    empty = np.full((244, 324), 120) + np.random.default_rng(5).normal(0, 20, (244, 324))
    assert lines.strongest(lines.classical(lines.shrink(empty)), CAMERA).strength < 0.3 * line.strength


def level_flight(speed=0.3, clearance=0.04):
    """A drone that flies straight on at constant speed over a platform from x = 0 to 0.75 m."""
    n = 700
    t = 0.01 * np.arange(n)
    x = speed * t - 0.9
    over = (x >= 0.0) & (x < 0.75)
    zero = np.zeros(n)
    columns = {"t_s": t, "x_m": x, "y_m": zero, "z_m": np.full(n, 0.8), "roll_rad": zero, "pitch_rad": zero,
               "yaw_rad": zero,
               "zrange_m": np.where(over, clearance, 0.8)}
    log = FlightLog(columns,
                    {"source": "level", "format": "made", "sample_period_s": 0.01, "flight": 0, "warnings": []})
    edges = (Edge(int(np.argmax(over)), "entry", 0.8, 0.04), Edge(int(n - np.argmax(over[::-1])), "exit", 0.04, 0.8))
    return log, edges


def made_film():
    from airtouch.vision import crossings, scene

    log, edges = level_flight()
    rng = np.random.default_rng(6)
    corners = np.array([[0.0, -2.0], [0.75, -2.0], [0.75, 2.0], [0.0, 2.0]])
    floor = scene.Scene(scene.texture(rng, 0.25, 0.05), scene.texture(rng, 0.7, 0.05), corners, 0.76)
    return crossings.Film(log, edges, floor, 0.04, 0.3, edges[0].sample * 0.01 - 0.6, edges[1].sample * 0.01 + 0.6)


def test_in_good_light_the_camera_places_both_edges_within_a_centimetre():
    from airtouch.vision import compare, lines

    film = made_film()
    sights = compare.sights_of_films([film], 500.0, {"classical": lines.classical}, 7)["classical"]
    detections = compare.crossings([film], sights, compare.threshold([film], sights))
    score = compare.flight_scores([film], detections)[0]
    assert [e.detected_sample is not None for e in score.edges] == [True, True] and score.false == ()
    assert max(abs(e.error_m) for e in score.edges) < 0.01


def test_frames_come_at_the_cameras_rate():
    from airtouch.vision import crossings

    film = made_film()
    times = [time_s for time_s, _ in crossings.frames(CAMERA, film, 100.0, 8)]
    assert np.diff(times) == pytest.approx(1 / 6.0) and film.first_s <= times[0] and times[-1] < film.last_s


def test_a_line_ahead_is_crossed_after_its_distance_over_the_speed():
    from airtouch.vision.crossings import Sight, detections

    sights = [Sight(2.0, 0.9, 0.03), Sight(2.16, 0.9, -0.018), Sight(3.0, 0.1, 0.0), Sight(5.0, 0.8, 0.0)]
    assert [d.sample for d in detections(sights, 0.5, 0.3)] == [210, 500]


def test_a_fusion_weighs_pairs_and_drops_or_keeps_single_edges():
    from airtouch.vision.compare import Fusion, fuse

    camera = [Detection(100, "edge"), Detection(400, "edge")]
    airtouch = [Detection(140, "entry"), Detection(700, "exit")]
    assert [d.sample for d in fuse(camera, airtouch, Fusion(0.25, True, True))] == [130, 400, 700]
    assert [d.sample for d in fuse(camera, airtouch, Fusion(1.0, False, True))] == [100, 700]
    assert [d.sample for d in fuse(camera, airtouch, Fusion(0.0, True, False))] == [140, 400]


@pytest.mark.parametrize(("camera_off", "airtouch_off"), [(1, 20), (20, 1)])
def test_the_sharper_sense_gets_the_weight_and_the_other_ones_inventions_are_dropped(camera_off, airtouch_off):
    from airtouch.vision import compare

    rng = np.random.default_rng(9)
    film = made_film()
    films = [film] * 12

    def sense(off):
        real = [[Detection(e.sample + round(rng.normal(0, off)), "edge") for e in film.edges] for _ in films]
        return [r + [Detection(20, "edge")] if off > 10 else r for r in real]

    chosen = compare.choose_fusion(films, sense(camera_off), sense(airtouch_off))
    assert (chosen.share >= 0.75) == (camera_off < airtouch_off)
    assert not (chosen.airtouch_alone if camera_off < airtouch_off else chosen.camera_alone)


def test_the_weights_are_the_inverse_squared_errors():
    """Errors of +-10 and +-20 samples: 20^2 / (10^2 + 20^2) = 0.8 for the camera; almost none for one without edges."""
    from airtouch.vision import compare

    films = [made_film()] * 4

    def sense(off):
        return [[Detection(e.sample + off * (-1) ** i, "edge") for e in film.edges] for i, film in enumerate(films)]

    assert compare.choose_fusion(films, sense(10), sense(20)).share == pytest.approx(0.8, abs=0.001)
    assert compare.choose_fusion(films, [[]] * 4, sense(20)).share < 0.02


def test_a_constant_lag_is_learnt_on_the_first_films_and_taken_off_all():
    from airtouch.vision import compare

    film = made_film()
    late = [[Detection(e.sample + off, "edge") for e in film.edges] for off in (7, 7, 12)]
    corrected = compare.without_lag(late, compare.lag([film, film], late[:2]))
    off = [[d.sample - e.sample for d, e in zip(some, film.edges, strict=True)] for some in corrected]
    assert off == [[0, 0], [0, 0], [5, 5]]


def test_a_flight_that_crosses_no_edge_makes_no_film():
    from airtouch.simulation import batch
    from airtouch.vision import crossings

    (log,) = batch.simulate("paper-4cm", workers=1)
    assert len(crossings.film(log, 1).edges) == 2
    with pytest.raises(AirTouchError, match="crosses no edge"):
        crossings.film(log.slice(0, true_edges(log)[0].sample - 100), 1)
