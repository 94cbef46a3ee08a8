"""Power that random effects add to block sums, and what the map has left of it with them in the model.

In closed form, and against simulated pairs of flights of one seed, with the effect and without it.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.stats import t as student

from airtouch.gap.flights.flight import GROUND
from airtouch.gap.nominal.build_study import declared_study
from airtouch.gap.signals.channels import FORCE, TORQUE
from airtouch.gap.signatures.candidates import mean_of, random_of, random_part_of, terms
from airtouch.gap.where.band_sums import block_sums
from airtouch.gap.where.filter_bank import sensor_rms
from airtouch.gap.where.gap_map import gap_map
from airtouch.gap.where.random_power import SumsWith, random_power
from airtouch.logs.segments import KINDS
from gap_flights import HOVER, VEHICLE, flight, fly, study

FLIGHTS = 8  #: pairs of flights
CHANCE = 1e-3  #: that a right model leaves the limits of a comparison somewhere
#: fraction by which a right model may be off where the scatter allows less, as the loop's model is one of small signals
#: and the turbulence is drawn once a sample; chosen, 1 dB
LOOP_ERROR = 0.25
PLATFORM = KINDS.index("over platform")
IN_AIR = [p for p in range(len(KINDS)) if p != GROUND]


@cache
def nominal_study():
    return declared_study(VEHICLE, fly(5, 41))


@cache
def calm():
    return fly(FLIGHTS, 7)


def with_values(name, **values):
    """The variant of an effect whose other parameters have these values."""
    alike = [t for t in terms(name) if all(t.values[k] == v for k, v in values.items() if k not in t.free)]
    return replace(alike[0], values={**alike[0].values, **values})


def with_turbulence(name, strength, turbulence, **values):
    """The mean and the random part of an effect, as a diagnosis names them, and its values as the simulator has them.

    The random part is one of strength 1.
    """
    mean, random = terms(name)[0], random_part_of(name)
    shape = {**{k: v for k, v in mean.values.items() if k not in ("strength", "turbulence")}, **values}
    parts = [replace(mean, values={**mean.values, **shape, "strength": strength}),
             replace(random, values={**random.values, **shape, "turbulence": strength * turbulence})]
    return parts, {**shape, "strength": strength, "turbulence": turbulence}


def per_sample(sums, power, rows):
    """Mean square (bands, COUNT) of some rows."""
    return power[rows, 0].sum(axis=0) / sums.weight[rows, 0].sum()


def added_and_expected(effect, parts, phases):
    """Mean squares (flights, bands, COUNT) that the effect adds to simulated flights, and what is expected of them.

    Third: the mean squares of the flights without it. All are of some phases.
    """
    out = []
    for without, shaken in zip(calm(), fly(FLIGHTS, 7, [effect]), strict=True):
        gap = nominal_study().residual(shaken, [t.active() for t in mean_of(parts)])
        sums = block_sums(shaken, gap, VEHICLE)
        before = block_sums(without, nominal_study().residual(without), VEHICLE)
        expected = random_power(nominal_study(), shaken, random_of(parts)).mean
        rows, rows_before = np.isin(sums.phase, phases), np.isin(before.phase, phases)
        of_calm = per_sample(before, before.power, rows_before)
        out.append((per_sample(sums, sums.power, rows) - of_calm, per_sample(sums, expected, rows), of_calm))
    return np.array(out).swapaxes(0, 1)


def ratio_and_scatter(added, expected):
    """Ratio of the means over flights, each (flights, ...), and its standard deviation by their scatter."""
    size = expected.mean(axis=0)
    return added.mean(axis=0) / size, added.std(axis=0, ddof=1) / np.sqrt(len(added)) / size


def assert_as_expected(added, expected, error=0.0):
    """All cells (flights, ...) within their scatter; error: by which the model may be off beside it."""
    ratio, scatter = ratio_and_scatter(added, expected)
    wide = student.isf(0.5 * CHANCE / ratio.size, len(added) - 1)
    assert (np.abs(ratio - 1.0) < wide * scatter + error).all(), f"{ratio.round(2)}, scatter {scatter.round(2)}"


@pytest.mark.parametrize(("name", "values", "channels"), [
    ("motor_noise", {"time": 0.005, "rms": 0.1}, [2, 3, 4, 5]),
    ("motor_noise", {"time": 0.1, "rms": 0.05}, [2, 3, 4, 5]),
    ("gust", {"length": 0.5, "rms": 0.3}, [0, 1]), ("imu_noise", {"factor": 2.0}, [0, 1, 2, 3, 4, 5])])
def test_in_the_air_the_power_is_that_of_simulated_pairs(name, values, channels):
    part = with_values(name, **values)
    added, expected, _ = added_and_expected((name, dict(part.values)), [part], IN_AIR)
    assert_as_expected(added[:, :, channels], expected[:, :, channels], LOOP_ERROR)


def test_the_torque_of_a_wake_is_that_of_simulated_pairs():
    parts, values = with_turbulence("downwash", 0.1, 0.6, width=0.0)
    added, expected, _ = added_and_expected(("downwash", values), parts, IN_AIR)
    assert_as_expected(added[:, :, TORQUE], expected[:, :, TORQUE], LOOP_ERROR)


def test_air_that_is_unsteady_near_the_ground_shakes_there_alone():
    """Roll and pitch from 2 to 25 Hz: over the platform as simulated, and in the hover hardly more than without."""
    parts, values = with_turbulence("ground_effect", 0.3, 1.0)
    added, expected, _ = added_and_expected(("ground_effect", values), parts, [PLATFORM])
    assert_as_expected(added[:, 2:5, 3:5], expected[:, 2:5, 3:5], LOOP_ERROR)
    high, expected_high, of_calm = added_and_expected(("ground_effect", values), parts, [HOVER])
    assert np.abs(high[:, 2:5, 3:5].mean(axis=0) / of_calm[:, 2:5, 3:5].mean(axis=0)).max() < 0.05
    assert (expected_high[:, 2:5, 3:5].mean(axis=0) / of_calm[:, 2:5, 3:5].mean(axis=0)).max() < 0.15


def test_at_rest_noise_of_the_imu_is_that_of_simulated_pairs():
    noise = with_values("imu_noise", factor=2.0)
    added, expected, _ = added_and_expected(("imu_noise", {"factor": 2.0}), [noise], [GROUND])
    assert_as_expected(added[:, :, FORCE], expected[:, :, FORCE])
    assert_as_expected(added[:, 2:, TORQUE], expected[:, 2:, TORQUE])


def test_noise_twice_as_loud_adds_three_times_the_power_of_the_declared_in_each_band():
    """In the air and at rest, where a bin of the spectra is wider than the lowest two bands."""
    hover = flight(20.0, resting_s=4.0)
    noise = with_values("imu_noise", factor=2.0)
    sums = block_sums(hover, np.zeros((len(hover), 13)), VEHICLE)
    power = random_power(study(), hover, [noise]).mean
    for rows in (sums.phase == GROUND, sums.phase == HOVER):
        expected = 3.0 * sensor_rms(VEHICLE) ** 2
        np.testing.assert_allclose(per_sample(sums, power, rows)[:, FORCE], expected[:, FORCE], rtol=0.03)
        np.testing.assert_allclose(per_sample(sums, power, rows)[3:, TORQUE], expected[3:, TORQUE], rtol=0.03)


def test_a_passing_effect_adds_its_power_in_its_seconds_alone():
    hover = flight(20.0, name="shaken")
    noise = with_values("imu_noise", factor=2.0)
    sums = block_sums(hover, np.zeros((len(hover), 13)), VEHICLE)
    whole, part = (random_power(study(), hover, [replace(noise, gate=g)]).mean[:, 0, 5, 0].sum()
                   for g in ((), (("shaken", 5.0, 9.0), ("another", 0.0, 20.0))))
    assert part == pytest.approx(0.2 * whole) and len(sums.phase) > 5


def squares_of_map(flights, parts=()):
    """Mean squares (cells,) of the map's force and torque in the air, without the parts (gap) and with them (after)."""
    cells = [c for c in gap_map(nominal_study(), flights, terms=parts).cells
             if c.regime == "all" and c.phase in ("hover", "cruise") and c.channel.startswith(("force", "torque"))]
    return np.array([c.gap for c in cells]) ** 2, np.array([c.after if parts else np.nan for c in cells]) ** 2


def of_times_the_power(name, values, key, times):
    """The terms of an effect whose random part has so many times the power of the effect with these values.

    key: of the value that is its strength. Also the values of the effect that is simulated.
    """
    root = np.sqrt(times)
    if key == "turbulence":
        _, flown = with_turbulence(name, **values)
        return with_turbulence(name, **{**values, key: root * values[key]})[0], flown
    louder = root * values[key] if key != "factor" else np.sqrt(1.0 + times * (values[key] ** 2 - 1.0))
    part = with_values(name, **values)
    return [replace(part, values={**part.values, key: louder})], dict(part.values)


RANDOM = pytest.mark.parametrize(("name", "values", "key"), [
    ("downwash", {"strength": 0.1, "turbulence": 0.6, "width": 0.0}, "turbulence"),
    ("gust", {"length": 0.5, "rms": 0.3}, "rms"), ("motor_noise", {"time": 0.005, "rms": 0.1}, "rms"),
    ("motor_noise", {"time": 0.1, "rms": 0.05}, "rms"), ("imu_noise", {"factor": 2.0}, "factor")])


@RANDOM
def test_with_the_true_effect_the_map_of_a_flight_is_that_of_the_flight_without_it(name, values, key):
    """In the cells that the effect moves by half or more, most of what is left by chance is taken away."""
    parts, flown = of_times_the_power(name, values, key, 1.0)
    pairs = [(squares_of_map([without])[0], *squares_of_map([shaken], parts))
             for without, shaken in zip(calm(), fly(FLIGHTS, 7, [(name, flown)]), strict=True)]
    of_calm, before, after = (np.sqrt(x) for x in np.array(pairs).swapaxes(0, 1))
    moved = (before / of_calm).mean(axis=0) > 1.5
    assert moved.sum() >= 8, "forces or torques, in hover and cruise"
    assert np.median(((after - of_calm) / (before - of_calm))[:, moved]) < 0.15
    assert np.median((after / of_calm)[:, moved]) > 1.0 - LOOP_ERROR


@RANDOM
@pytest.mark.parametrize(("times", "share"), [(0.5, 0.5), (1.0, 0.0), (2.0, 1.0)])
def test_of_a_wrong_power_the_map_has_the_difference_left(name, values, key, times, share):
    """Of half the power half is left, and of twice the power as much too much as there is."""
    parts, flown = of_times_the_power(name, values, key, times)
    before, after = squares_of_map(fly(FLIGHTS, 7, [(name, flown)]), parts)
    of_calm, _ = squares_of_map(calm())
    moved = before > 1.5 ** 2 * of_calm
    remaining_share = (after - of_calm)[moved] / (before - of_calm)[moved]
    assert np.median(remaining_share) == pytest.approx(share, abs=LOOP_ERROR)


@pytest.mark.parametrize("times", [2.0, 3.0])
def test_too_much_power_counts_as_gap_in_a_single_flight_s_short_phases(times):
    """Landing and platform have a block or two, whose power above 6 Hz scatters by a quarter at most."""
    (one, *_) = fly(1, 7, [("motor_noise", dict(with_values("motor_noise", time=0.005, rms=0.1).values))])
    parts, _ = of_times_the_power("motor_noise", {"time": 0.005, "rms": 0.1}, "rms", times)
    cells = [c for c in gap_map(nominal_study(), [one], terms=parts).cells
             if c.regime == "all" and c.phase in ("landing", "over platform") and c.band_hz[0] >= 6.0
             and c.channel in ("force_z", "torque_x", "torque_y")]
    assert len(cells) == 18 and all(c.blocks <= 2 for c in cells)
    assert np.median([c.after / c.gap for c in cells]) > 0.6 * np.sqrt(times - 1.0)
    assert min(c.after / c.gap for c in cells) > 0.3


def test_the_variance_of_the_power_is_that_of_pieces_of_noise():
    """White noise in blocks of 2.56 s: the mean square of the power's relative deviations, over what is expected."""
    hover, noise = flight(240.0), with_values("imu_noise", factor=2.0)
    drawn = np.random.default_rng(3).normal(0.0, 1.0, (len(hover), 13))
    mean, variance = (x[:, 0, 1:, 0] for x in random_power(study(), hover, [noise]))
    power = block_sums(hover, drawn, VEHICLE).power[:, 0, 1:, 0]
    away = (power / power.mean(axis=0) - 1.0) ** 2 * mean ** 2 / variance
    assert len(away) > 80 and away.mean(axis=0) == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / len(away)))


def test_much_too_much_power_counts_as_gap_in_a_single_block_of_the_lowest_bands():
    """Noise that is just as strong as on average leaves nothing of it, or, where it is taken four times, as much."""
    hover, noise = flight(2.56), with_values("imu_noise", factor=2.0)
    mean, variance = (np.where(x > 0.0, x, np.nan) for x in random_power(study(), hover, [noise]))
    sums, no_noise = block_sums(hover, np.zeros((len(hover), 13)), VEHICLE), np.zeros(sensor_rms(VEHICLE).shape)
    of_right, of_four = (SumsWith(*(replace(sums, power=x) for x in (mean, n * mean, n ** 2 * variance)))
                         for n in (1.0, 4.0))
    right, four = of_right.mean_square(no_noise), of_four.mean_square(no_noise)
    of_block = of_right.gap.mean_square()
    assert len(sums.phase) == 1 and np.all(right[0, :2, 0] == 0.0) and np.all(four[0, :2, 0] > of_block[0, :2, 0])
