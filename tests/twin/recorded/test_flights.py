"""Flights of a folder as a twin takes them: those that can be used, those left out with the reason, by fold."""

import numpy as np
import pytest

from airtouch import logs
from airtouch.errors import AirTouchError
from airtouch.logs.flight_log import FlightLog
from airtouch.twin.recorded import flights
from airtouch.twin.recorded.features import names


@pytest.fixture(scope="module")
def folder(sweeps, tmp_path_factory):
    """Six usable flights in folds 0 and 1, one without a down range in fold 1, and their manifest."""
    out = tmp_path_factory.mktemp("flights")
    rows = ["file,use,fold,speed_mps"]
    for i, (course, log, _) in enumerate(sweeps[:6]):
        logs.write(log, out / f"f{i}.csv.gz")
        rows.append(f"f{i}.csv.gz,clean,{i % 2},{course.speed_mps}")
    blind = sweeps[6][1]
    logs.write(FlightLog({k: v for k, v in blind.columns.items() if k != "zrange_m"}, blind.meta), out / "blind.csv.gz")
    (out / "manifest.csv").write_text("\n".join([*rows, "blind.csv.gz,clean,1,0.3"]) + "\n")
    return out


def test_every_usable_flight_has_a_course_channels_and_features(folder, sweeps):
    steps = []
    recorded = flights.read([folder], progress=lambda count, total: steps.append((count, total)))
    assert len(recorded.courses) == len(recorded.channels) == len(recorded.features) == 6
    assert recorded.features.shape == (6, len(names())) and recorded.channels[0].shape[1] == 12
    assert [c.speed_mps for c in recorded.courses] == pytest.approx([c.speed_mps for c, _, _ in sweeps[:6]])
    (path, reason), = recorded.left_out
    assert path.endswith("blind.csv.gz") and "no down range in this log" in reason
    assert steps[-1] == (7, 7) and np.isfinite([c.clearance_m for c in recorded.courses]).all()


def test_too_few_flights_of_a_fold_say_what_to_fly(folder):
    with pytest.raises(AirTouchError, match="3 of 4 flights can be used and 4 are needed: fly straight .* 1 more"):
        flights.read([folder], folds=[1])
    with pytest.raises(AirTouchError, match="no flight is in fold 7 of the manifest"):
        flights.read([folder], folds=[7])
