"""What the detectors of the registry have in common."""

import numpy as np
import pytest

from airtouch import vehicle
from airtouch.detector import registry
from airtouch.detector.shared import sensors
from airtouch.simulation import scenario
from airtouch.simulation.flight import fly


@pytest.fixture(scope="module")
def log():
    return fly(scenario.load("paper-low"), vehicle.load(), seed=1)


@pytest.mark.parametrize("name", [n for n in registry.DETECTORS if n != "baseline"])
def test_the_shipped_model_runs_in_float_as_in_int8(name, log):
    """Without a model, `run_float` takes the same as `run`: P(over a platform) hardly differs."""
    detector = registry.get(name)
    assert isinstance(detector, registry.InFloat)
    quantised, in_float = detector.run(log).probability, detector.run_float(log).probability
    np.testing.assert_array_equal(in_float, detector.run_float(log, detector.load(None)).probability)
    assert np.nanmean(np.abs(quantised - in_float)) < 0.02 < np.nanmax(quantised)


def test_in_float_best_takes_the_model_that_serves_the_log(log):
    best = registry.get("best")
    without = sensors.without(log, ("acceleration",))
    served = best.model_for(None, without)
    assert served.digest != best.load(None).digest
    np.testing.assert_array_equal(best.run_float(without).probability, best.run_float(without, served).probability)
