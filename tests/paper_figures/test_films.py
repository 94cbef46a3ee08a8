"""What is stored of a film is used again for the same film alone."""

from dataclasses import replace

import numpy as np

from airtouch.logs.flight_log import FlightLog
from airtouch.paper_figures.figures.films import film_digest
from skips import needs


@needs("cv2")
def test_a_film_of_another_flight_scene_or_length_is_another():
    from airtouch.vision.crossings import Film
    from airtouch.vision.scene import Scene

    scene = Scene(np.zeros((4, 4)), np.ones((4, 4)), np.zeros((4, 2)), 0.2)
    film = Film(FlightLog({"x_m": np.zeros(5)}, {}), (), scene, 0.04, 0.3, 1.0, 4.0)
    others = [replace(film, log=FlightLog({"x_m": np.full(5, 1e-9)}, {})), replace(film, last_s=4.01),
              replace(film, scene=replace(scene, top=np.full((4, 4), 0.5)))]
    assert len({film_digest(one) for one in (film, replace(film), *others)}) == 4
