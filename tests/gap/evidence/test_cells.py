"""Numbers of cells: the place that each stands for, and the groups of cells that count together."""

import numpy as np
import pytest

from airtouch.gap.evidence.cells import (
    CELLS,
    COMMAND_VIEW,
    REPLAY_VIEW,
    REST_VIEW,
    above_means,
    band_cells,
    cell_indices,
    cell_numbers,
    channel_cells,
    place_of,
    sensor_cells,
)
from airtouch.gap.signals.channels import CHANNELS, COUNT

NAMES = [c.name for c in CHANNELS]


@pytest.mark.parametrize(("view", "band", "channel", "band_hz"), [
    (REPLAY_VIEW, 0, "force_z", (0.0, 0.6)), (REPLAY_VIEW, 5, "torque_x", (25.0, 50.0)),
    (REST_VIEW, 1, "rate_y", (0.6, 2.0)), (COMMAND_VIEW, 2, "command_roll", (0.6, 2.0))])
def test_place_of_a_cell_is_its_view_channel_and_band(view, band, channel, band_hz):
    number = cell_numbers(view, band, NAMES.index(channel))
    assert cell_indices(number) == (view, band, NAMES.index(channel))
    assert place_of(number) == (view, channel, pytest.approx(band_hz))


def test_a_band_and_the_bands_above_the_means_are_told_by_the_number():
    force_z, rate_x = (NAMES.index(name) for name in ("force_z", "rate_x"))
    for view in (REPLAY_VIEW, REST_VIEW):
        cells = [cell_numbers(view, band, channel) for band in (0, 1, 5) for channel in (force_z, rate_x)]
        assert band_cells()[cells].tolist() == [cell_numbers(view, band, 0) for band in (0, 0, 1, 1, 5, 5)]
        assert above_means()[cells].tolist() == [False, False, True, True, True, True]


def test_all_bands_of_a_channel_have_one_number_and_no_other_has_it():
    seen = {}
    for view in (REPLAY_VIEW, REST_VIEW, COMMAND_VIEW):
        for channel in range(COUNT):
            numbers = {channel_cells()[cell_numbers(view, band, channel)] for band in range(7)}
            assert len(numbers) == 1
            seen[view, channel] = numbers.pop()
    assert len(set(seen.values())) == 3 * COUNT and len(channel_cells()) == CELLS


def test_the_cells_of_a_sensor_are_those_of_its_axes_in_one_band():
    for view, band in ((REPLAY_VIEW, 0), (REST_VIEW, 3), (COMMAND_VIEW, 2)):
        numbers = {name: int(sensor_cells()[cell_numbers(view, band, NAMES.index(name))]) for name in NAMES}
        for sensor in ("force", "torque", "rate"):
            axes = {numbers[f"{sensor}_{axis}"] for axis in "xyz"}
            assert axes == {cell_numbers(view, band, NAMES.index(f"{sensor}_x"))}


def test_every_cell_of_the_commands_is_above_the_means():
    """Their bands count from 1, as `flattened` numbers them: the lowest has none of the means either."""
    lowest = cell_numbers(COMMAND_VIEW, 1, np.arange(COUNT))
    assert above_means()[lowest].all() and {place_of(int(n)).band_hz[0] for n in lowest} == {0.0}
