"""Lost rows: what bridging them adds to the spectra, and that it is no effect."""

import numpy as np
import pytest

from airtouch.gap.answer.named_effects import named_effects
from airtouch.gap.evidence.data import Data
from airtouch.gap.naming.select import select
from airtouch.gap.signals.lost_rows import bridging_power
from airtouch.gap.signals.spectra import AIR, frequencies
from airtouch.gap.signatures.candidates import all_candidates
from gap_flights import VEHICLE, fly

PITCH = 4  #: channel of the pitch torque
LOSS = {"packet_loss": {"share": 0.02, "burst": 4.0}}


@pytest.fixture(scope="module")
def pairs():
    """Flights with rows lost, and the same flights (same seed) with every row."""
    return fly(6, 77, LOSS), fly(6, 77)


def test_a_flight_without_lost_rows_has_none():
    complete = fly(1, 3)[0]
    assert not complete.lost.any()
    assert not bridging_power(complete, VEHICLE, (), np.array([300, 428])).any()


def test_what_lost_rows_add_is_what_the_same_flights_with_every_row_lack(pairs, study):
    """Power of the difference between a flight with lost rows and itself with every row, 2 to 50 Hz, by channel, dB."""
    poor, rich = (Data(study, flights) for flights in pairs)
    power, expected = [], []
    for k, lossy in enumerate(poor.flights):
        assert 20 < lossy.lost.sum() < 100
        _, mine, theirs = np.intersect1d(poor.block_starts[k][AIR], rich.block_starts[k][AIR], return_indices=True)
        power.append(np.abs(poor.residual[k][AIR][mine] - rich.residual[k][AIR][theirs]) ** 2)
        expected.append(poor.bridging[k][mine])
    band = frequencies(AIR) > 2.0
    power, expected = (np.nanmean(np.concatenate(x)[:, band, :6], axis=(0, 1)) for x in (power, expected))
    error = np.abs(10.0 * np.log10(expected / power))
    assert np.delete(error, PITCH).max() < 1.0
    assert error[PITCH] < 6.0  # a set-point that steps kicks the pitch command in one row of many


def test_lost_rows_alone_are_named_alone(pairs, study):
    """Bursts of lost rows used to look like a wake or like noise of the motors beside them."""
    for flight in pairs[0][:3]:
        data = Data(study, [flight])
        selection = select(data, all_candidates())
        assert [s.name for s in selection.steps if s.is_named] == ["packet_loss"]
        share = named_effects(data, selection)[0].parameters["share"]
        assert share.high > 1.2 * share.value, "48 rows in 12 bursts say the share to a quarter at best"
