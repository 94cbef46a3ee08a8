"""Whether pushes point down: SciPy's skewness of the filtered force, and its sign in flights that are pushed."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt
from scipy.stats import skew

from airtouch.gap.evidence.data import Data
from airtouch.gap.flights.flight import PERIOD_S
from airtouch.gap.passing.gate_search import ENDS
from airtouch.gap.passing.one_sided import PUSH_BAND_HZ, downward
from airtouch.gap.signals.channels import residual
from gap_flights import fly


@pytest.fixture(scope="module")
def nominal_flight():
    return fly(1, 62)[0]


def pushed(nominal, force_mps2):
    """A flight in the air that is pushed along its thrust for 0.3 s, once in 2 s."""
    acceleration = nominal.acceleration.copy()
    acceleration[np.arange(len(nominal)) % int(2.0 / PERIOD_S) < int(0.3 / PERIOD_S), 2] += force_mps2
    return replace(nominal, acceleration=acceleration)


@pytest.mark.parametrize("force_mps2", [-1.0, 0.5])
def test_it_is_the_skewness_of_the_filtered_force(study, nominal_flight, force_mps2):
    flight = pushed(nominal_flight, force_mps2)
    counts = ~(flight.on_ground | flight.bridged | np.isin(flight.phase, ENDS))
    force = residual(flight, study.vehicle, study.calibration)[:, 2]
    samples = np.arange(len(force))
    force = np.interp(samples, samples[counts], force[counts])
    for hertz, kind in zip(PUSH_BAND_HZ, ("highpass", "lowpass"), strict=True):
        force = sosfiltfilt(butter(2, hertz * 2.0 * PERIOD_S, kind, output="sos"), force)
    assert downward(Data(study, [flight])) == pytest.approx(-skew(force[counts]), rel=0.01, abs=0.01)


def test_pushes_down_count_up(study, nominal_flight):
    none, down, up = (downward(Data(study, [pushed(nominal_flight, f)])) for f in (0.0, -1.0, 1.0))
    assert down > none + 0.5 and up < none - 0.5
    assert downward(Data(study, [pushed(nominal_flight, -1.0), pushed(nominal_flight, 1.0)])) == pytest.approx(
        0.0, abs=0.1), "of two flights, one pushed down and one up"


def test_a_flight_that_only_takes_off_says_nothing(study, nominal_flight):
    assert downward(Data(study, [replace(nominal_flight, phase=np.full(len(nominal_flight), ENDS[0]))])) == 0.0
