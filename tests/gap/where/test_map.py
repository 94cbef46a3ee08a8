"""The gap map against closed forms: noise, offsets, tones and short phases of known size."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from airtouch.gap.flights.flight import GROUND
from airtouch.gap.signals.channels import CHANNELS
from airtouch.gap.signatures.candidates import terms
from airtouch.gap.where import gap_map as maps
from airtouch.gap.where.band_sums import block_sums, stretches
from airtouch.gap.where.cell_words import in_words
from airtouch.gap.where.filter_bank import MAP_BANDS_HZ, filtered, gains, sensor_rms
from airtouch.gap.where.regimes import REGIMES, regimes
from airtouch.gap.where.summary import largest, significant
from airtouch.simulation import signals as at
from airtouch.simulation.flight import prepare
from gap_flights import HOVER, TAKE_OFF, VEHICLE, flight, noise, study

NOISE = float(prepare(VEHICLE, ())[0][0]["acc_noise"][0])
WIDTH = np.array([b - a for a, b in MAP_BANDS_HZ])


def cell(gap_map, channel, band, phase="hover", regime="all"):
    return next(c for c in gap_map.cells if (c.channel, c.band_hz, c.phase, c.regime)
                == (channel, MAP_BANDS_HZ[band], phase, regime))


def test_bands_share_the_power_out():
    f = (np.arange(5000) + 0.5) * 0.01
    assert np.allclose((gains(f) ** 2).sum(axis=0), 1.0)
    assert (gains(f) ** 2).mean(axis=1) * 50.0 == pytest.approx(WIDTH, rel=2e-3)


@pytest.mark.parametrize("rms", [0.05, 3.0])
def test_white_noise_has_its_rms_in_every_band(rms):
    gap_map = maps.gap_map(study(), [flight(120.0, noise(120.0, rms, 1))])
    for b, width in enumerate(WIDTH):
        for axis in "xyz":
            c = cell(gap_map, f"force_{axis}", b)
            expected = rms * np.sqrt(width / 50.0)
            assert c.gap == pytest.approx(expected, rel=0.25 if b == 0 else 0.1)
            assert c.low < expected < c.high and c.unit == "m/s^2" and c.blocks == 47 and c.flights == 1


def test_intervals_hold_the_true_rms_in_85_of_100_cells():
    inside = []
    for seed in range(30):
        gap_map = maps.gap_map(study(), [flight(30.0, noise(30.0, 1.0, seed))])
        inside += [cell(gap_map, "force_x", b).low < np.sqrt(w / 50.0) < cell(gap_map, "force_x", b).high
                   for b, w in enumerate(WIDTH)]
    assert np.mean(inside) >= 0.85


def test_an_offset_is_in_the_lowest_band_alone():
    gap_map = maps.gap_map(study(), [flight(7.0, np.array([0.5, 0.0, -0.2]))])
    assert cell(gap_map, "force_x", 0).gap == pytest.approx(0.5)
    assert cell(gap_map, "force_z", 0).gap == pytest.approx(0.2)
    assert cell(gap_map, "force_x", 0).low == pytest.approx(0.5) == cell(gap_map, "force_x", 0).high
    assert all(cell(gap_map, f"force_{a}", b).gap < 1e-9 for a in "xyz" for b in range(1, 6))


@pytest.mark.parametrize(("hz", "band"), [(1.0, 1), (4.0, 2), (8.1, 3), (18.0, 4), (40.0, 5)])
def test_a_tone_is_in_its_band(hz, band):
    t = np.arange(2000) * 0.01
    tone = np.zeros((2000, 3))
    tone[:, 1] = 0.8 * np.sin(2 * np.pi * hz * t)
    gap_map = maps.gap_map(study(), [flight(20.0, tone)])
    assert cell(gap_map, "force_y", band).gap == pytest.approx(0.8 / np.sqrt(2), rel=0.05)
    assert sum(cell(gap_map, "force_y", b).gap ** 2 for b in range(6) if b != band) < 0.02 * 0.32


def test_a_phase_shorter_than_a_block_keeps_what_is_in_it():
    n = 1200
    phase, force = np.full(n, HOVER), np.zeros((n, 3))
    phase[:50] = TAKE_OFF
    force[:50, 2] = np.sin(2 * np.pi * 16.0 * np.arange(50) * 0.01)
    gap_map = maps.gap_map(study(), [flight(12.0, force, phase=phase)])
    assert cell(gap_map, "force_z", 4, "take-off").gap == pytest.approx(np.sqrt(0.5), rel=0.1)
    assert cell(gap_map, "force_z", 4).gap < 0.1
    assert cell(gap_map, "force_z", 4, "take-off").blocks == 1


@pytest.mark.parametrize(("phase", "baseline", "channel", "bands"), [
    (HOVER, False, "force_x", [0, 1, 2, 3, 4, 5]), (HOVER, False, "rate_x", []), (HOVER, True, "rate_x", [0]),
    (GROUND, False, "rate_x", [0]), (HOVER, True, "command_roll", [1, 2, 3, 4]), (GROUND, True, "command_roll", [])])
def test_a_cell_is_shown_where_it_means_something(phase, baseline, channel, bands):
    shown = maps.visible(phase, baseline)[:, [c.name for c in CHANNELS].index(channel)]
    assert np.flatnonzero(shown).tolist() == bands


def turning(seed, gyro=True, rms=0.01, resting_s=2.0):
    """Seconds of hover whose rates are white noise, and whose log has a gyro or not; on the ground before."""
    made = flight(20.0, noise(20.0, 0.06, seed), noise(20.0, rms, seed + 100), name=str(seed), resting_s=resting_s)
    return made if gyro else replace(made, rates=None)


def turning_rms(*seeds, first=200, rms=0.01):
    """Rms of the differences (rad/s^2) of the rates about x that `turning` draws, from a sample on."""
    rates = np.array([noise(20.0, rms, seed + 100)[first:, 0] for seed in seeds])
    return np.sqrt(np.mean(np.diff(rates, axis=1) ** 2)) / 0.01


def test_without_a_gyro_torque_is_known_in_the_air_at_low_frequency_only():
    shown = {(c.phase, c.band_hz) for c in maps.gap_map(study(), [turning(1, gyro=False)]).cells
             if c.channel.startswith("torque")}
    assert shown == {("hover", MAP_BANDS_HZ[0])}


def test_a_flight_without_a_gyro_takes_no_part_in_the_mean_of_torque():
    """Half of two flights: the cells are those of the flight that has it, in the gap as in the floor."""
    flown, nominal = [turning(1), turning(2, gyro=False)], [turning(3), turning(4, gyro=False), turning(5)]
    cells = maps.gap_map(study(), flown, nominal)
    for phase in ("hover", "ground"):
        torque = [cell(cells, "torque_x", b, phase) for b in range(1 if phase == "hover" else 0, 6)]
        assert {c.flights for c in torque} == {1} and cell(cells, "force_x", 5, phase).flights == 2
    hover = [cell(cells, "torque_x", b) for b in range(1, 6)]
    assert np.sqrt(sum(c.gap ** 2 for c in hover)) == pytest.approx(turning_rms(1), rel=0.02)
    assert np.sqrt(sum(c.floor ** 2 for c in hover)) == pytest.approx(turning_rms(3, 5), rel=0.02)
    assert all(c.low < c.gap < c.high for c in hover)


def test_the_floor_of_rates_is_what_nominal_flights_with_a_gyro_scatter_by():
    """Offsets of -0.3 and 0.3 rad/s; a third flight without a gyro leaves their standard deviation as it is."""
    nominal = [flight(20.0, gyro=o, name=str(o)) for o in (-0.3, 0.3)]
    nominal.append(replace(flight(20.0), rates=None))
    rate = cell(maps.gap_map(study(), [flight(20.0)], nominal), "rate_x", 0)
    assert rate.floor == pytest.approx(np.std([-0.3, 0.3], ddof=1))
    spread = maps.gap_map(study(), [flight(20.0, force=o, name=str(o)) for o in (0.0, 1.0)], [nominal[-1]])
    assert not [c for c in spread.cells if c.channel == "rate_x"], "no nominal flight to hold it against"


def test_lost_samples_do_not_count():
    force, lost = np.full((2000, 3), 0.3), np.zeros(2000, bool)
    force[700:720], lost[700:720] = 50.0, True
    gap_map = maps.gap_map(study(), [flight(20.0, force, lost=lost)])
    assert cell(gap_map, "force_x", 0).gap == pytest.approx(0.3)
    assert cell(gap_map, "force_x", 5).gap < 1e-9


def test_baseline_floor_is_what_differs_between_flights_not_what_they_share():
    offsets = np.array([-0.3, -0.1, 0.1, 0.3])
    nominal = [flight(20.0, 2.0 + o + noise(20.0, 0.2, i), name=str(i)) for i, o in enumerate(offsets)]
    gap_map = maps.gap_map(study(), [flight(20.0, 2.0 + noise(20.0, 0.06, 9))], nominal)
    lowest = cell(gap_map, "force_x", 0)
    assert lowest.gap == pytest.approx(2.0, rel=0.02)
    assert lowest.floor == pytest.approx(offsets.std(ddof=1), rel=0.08)
    assert cell(gap_map, "force_x", 5).floor == pytest.approx(0.2 * np.sqrt(0.5), rel=0.1)
    assert gap_map.floor_from == maps.BASELINE


def test_without_baseline_the_floor_is_sensor_noise_and_spread():
    same = [flight(20.0, 1.0 + noise(20.0, 0.06, i), name=str(i)) for i in range(3)]
    spread = [flight(20.0, o + noise(20.0, 0.06, i), name=str(i)) for i, o in enumerate((0.5, 1.0, 1.5))]
    sensor, rms = sensor_rms(VEHICLE), NOISE
    assert cell(maps.gap_map(study(), same), "force_x", 0).floor < 0.05
    assert cell(maps.gap_map(study(), spread), "force_x", 0).floor == pytest.approx(0.5, rel=0.05)
    assert sensor[:, 0] == pytest.approx(rms * np.sqrt(WIDTH / 50.0), rel=0.01)


def test_no_gap_is_rarely_called_one():
    def nominal(seed):
        return flight(20.0, noise(20.0, 0.06, seed), noise(20.0, 0.006, seed + 100))
    hits = [significant(c) for s in range(8) for c in maps.gap_map(
        study(), [nominal(s)], [nominal(50 + s), nominal(70 + s)]).cells if c.regime == "all"]
    assert np.mean(hits) < 0.02


def test_largest_names_what_was_injected():
    t = np.arange(2000) * 0.01
    force = noise(20.0, 0.06, 1)
    force[:, 2] += 0.5 * np.sin(2 * np.pi * 4.0 * t)
    gap_map = maps.gap_map(study(), [flight(20.0, force)], [flight(20.0, noise(20.0, 0.06, i)) for i in (2, 3)])
    first = largest(gap_map.cells)[0]
    assert (first.channel, first.band_hz) == ("force_z", (2.0, 6.0)) and first.gap == pytest.approx(0.35, rel=0.1)
    assert "2-6 Hz, lift: 0.35 m/s^2" in in_words(first) and "times the floor" in in_words(first)


def test_a_regime_is_named_only_where_it_is_worse_than_its_phase():
    force = noise(60.0, 0.06, 1)
    force[4000:, 0] += np.random.default_rng(0).normal(0.0, 1.0, 2000)
    cells = largest(maps.gap_map(study(), [flight(60.0, force)]).cells)
    assert cells and cells[0].channel == "force_x"
    assert any(c.regime == "last third of the flight" for c in cells)


@pytest.mark.parametrize(("name", "values", "force", "band"), [
    ("imu_bias", {"acc_x": 0.4}, np.array([0.4, 0.0, 0.0]), 0),
    ("imu_noise", {"factor": 4.0}, noise(40.0, 4.0 * NOISE, 3), 5)])
def test_after_an_effect_that_is_right_little_is_left(name, values, force, band):
    term = terms(name)[0]
    true_term = term.fitted(np.zeros(len(term.free)))
    true_term = type(term)(term.effect, term.shows_in, term.free, {**true_term.values, **values})
    c = cell(maps.gap_map(study(), [flight(40.0, force)], terms=[true_term]), "force_x", band)
    assert c.after < 0.25 * c.gap + c.floor and c.gap > 3 * c.floor


@pytest.mark.parametrize("column", ["zrange_m", "z_m"])
def test_the_height_is_a_regime_wherever_the_flight_has_it(column):
    low = flight(4.0)
    assert not regimes(low, VEHICLE)[:, 1:4].any()
    low.log.columns[column] = np.full(len(low), 0.05)
    low.signals[:, at.LOWER_HEIGHT:at.LOWER_HEIGHT + 4] = 0.05
    assert regimes(low, VEHICLE)[:, 1].all() and REGIMES[1] == "height < 0.1 m"


def test_of_several_effects_each_cell_names_the_one_that_takes_most():
    chosen = []
    for name, values in (("imu_bias", {"acc_x": 0.9}), ("imu_noise", {"factor": 4.0})):
        term = terms(name)[0]
        chosen.append(type(term)(term.effect, term.shows_in, term.free, {**term.values, **values}))
    force = noise(40.0, 4.0 * NOISE, 3) + np.array([0.9, 0.0, 0.0])
    gap_map = maps.gap_map(study(), [flight(40.0, force)], terms=chosen)
    assert cell(gap_map, "force_x", 0).by == "imu_bias" and cell(gap_map, "force_z", 5).by == "imu_noise"
    assert cell(gap_map, "force_x", 0).after < 0.3 and cell(gap_map, "torque_z", 0).by is None


def test_sums_of_phases_are_sums_of_blocks():
    per_block = block_sums(flight(20.0, noise(20.0, 1.0, 0)), np.zeros((2000, 13)) + 1.0, VEHICLE)
    per_phase = per_block.by_phase()
    assert len(per_block.phase) > 5 and len(per_phase.phase) == 1
    assert per_phase.weight[0, REGIMES.index("all")] == 2000
    assert per_phase.power[0, 0, 0] == pytest.approx(2000.0)


@given(st.integers(2, 900), st.integers(0, 2 ** 32 - 1))
def test_any_stretch_can_be_filtered(n, seed):
    values = np.random.default_rng(seed).normal(size=(n, 2))
    bands = filtered(values)
    assert bands.shape == (6, n, 2) and np.isfinite(bands).all()


def test_stretches_leave_contact_out():
    hover = flight(10.0)
    hover.usable[300:400] = False
    assert stretches(hover) == [(0, 300), (400, 1000)]


def test_a_random_effect_that_passes_adds_its_power_in_its_seconds_alone():
    """Noise four times as loud as declared for a quarter of the flight: with the effect there, the declared is left."""
    force = noise(40.0, NOISE, 3)
    force[1000:2000] *= 4.0
    flown = flight(40.0, force, name="shaken")
    term = terms("imu_noise")[0]
    louder = replace(term, values={**term.values, "factor": 4.0}, gate=(("shaken", 10.0, 20.0),))
    c = cell(maps.gap_map(study(), [flown], terms=[louder]), "force_x", 5)
    assert c.gap == pytest.approx(NOISE * np.sqrt((3.0 + 16.0) / 4.0 * WIDTH[5] / 50.0), rel=0.1)
    assert c.after < 0.6 * c.gap
