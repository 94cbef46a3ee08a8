"""Flights of which every one must be usable."""

import pytest

from airtouch import logs
from airtouch.detector.evaluation.crossval import all_readable
from airtouch.detector.evaluation.data.dataset import Condition, FlightFile
from airtouch.errors import AirTouchError
from made_flight import made_flight


def test_one_that_cannot_be_used_is_named_and_counted(tmp_path):
    files = [FlightFile(tmp_path / f"{name}.csv", Condition(speed_mps=0.3)) for name in ("good", "fine", "broken")]
    for file in files[:2]:
        logs.write(made_flight(), file.path)
    assert list(all_readable(files[:2])) == [file.path for file in files[:2]]
    files[2].path.write_text("not a log\n")
    with pytest.raises(AirTouchError, match=r"broken\.csv.*\(1 of 3 flights cannot be used: take them out\)"):
        all_readable(files)
