"""What several files of the diagnosis' tests share."""

import pytest

import imu_flights
from airtouch.gap.nominal import calibrate
from gap_flights import VEHICLE, fly
from shared_fixture import once


@pytest.fixture(scope="session")
def study(tmp_path_factory):
    """A vehicle calibrated on five nominal flights, with the scatter that others would measure when they need it."""
    def measured():
        on_demand = calibrate.calibrated(VEHICLE, fly(5, 41))[0]
        return on_demand.with_scatter(on_demand.scatter)

    return once(tmp_path_factory, "study", measured)


@pytest.fixture(scope="session")
def study_apart(tmp_path_factory, study):
    """A vehicle calibrated on three flights whose rotors turn at speeds of their own.

    How strong effects seem in them is taken from `study`: to fit every effect to three more flights is most of the
    work.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(calibrate, "baseline_scatter", lambda *_: study.scatter)
        return once(tmp_path_factory, "study_apart", lambda: calibrate.calibrated(
            imu_flights.VEHICLE, imu_flights.fly(3, imu_flights.APART, seed=31))[0])
