"""Camera and AirTouch are compared on equal terms: the lag of each is that on the training films."""

from types import SimpleNamespace

import pytest

from airtouch.detector.trace import Detection
from skips import needs


@needs("cv2")
@pytest.mark.parametrize("late", [0, 37])
def test_airtouchs_lag_is_that_on_the_training_films(monkeypatch, late):
    from airtouch.vision import compare

    def shot(first):
        edges = (SimpleNamespace(sample=first), SimpleNamespace(sample=first + 300))
        return SimpleNamespace(log=edges, edges=edges, first_s=first / 100 - 1.0, last_s=first / 100 + 4.0)

    films = [shot(first) for first in (300, 410, 520)]
    detector = SimpleNamespace(
        load=lambda _: None, lag_s=lambda _: 0.2,
        run=lambda edges, _: SimpleNamespace(edges=[Detection(e.sample + late, "edge") for e in edges]))
    monkeypatch.setattr(compare.registry, "get", lambda _: detector)
    crossings = compare.airtouch_crossings(films, "made", 2)
    assert [[d.sample for d in of_film] for of_film in crossings] == [[e.sample for e in f.edges] for f in films]
    without_edges = [shot(300)]
    without_edges[0].edges = ()
    assert compare.airtouch_crossings(without_edges, "made", 1)[0][0].sample == 300 + late - 20  # the model's own lag
