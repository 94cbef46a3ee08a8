"""The curves of a report: each has what its caption says, worked out by hand from synthetic flights."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from airtouch.gap.answer.curves import MOST_SPECTRA, curves_of
from airtouch.gap.flights.flight import PERIOD_S
from airtouch.gap.nominal.build_study import declared_study, sensor_noise
from airtouch.gap.result import NamedEffect, Quantity
from airtouch.gap.signals.channels import CHANNELS, COLUMN, COUNT, angular_acceleration
from airtouch.gap.signals.spectra import AIR, frequencies, starts
from airtouch.gap.signatures.candidates import term_of, terms
from airtouch.gap.study import Study
from airtouch.gap.where.gap_map import gap_map
from airtouch.logs.segments import KINDS
from airtouch.simulation import signals as at
from gap_flights import VEHICLE, flight, fly, noise
from hovers import FLOOR, LOUDNESS, hover
from made_diagnosis import cell

SECONDS = 15.0
TIME_S = np.arange(round(SECONDS / PERIOD_S)) * PERIOD_S
FORWARD = np.array([0.5, 0.0, 0.0])  #: m/s^2
LOWEST = cell("force_x", "hover", 0.5)
LOW = (LOWEST, replace(LOWEST, band_hz=(0.5, 2.0)))


def bias(mps2):
    return term_of(NamedEffect("imu_bias", {"acc_x": Quantity(mps2)}))


def curves_with(*flights, effects=(), cells=(LOWEST,), nominal=(), study=FLOOR, whole_map=LOW):
    return curves_of(study, flights, nominal, effects, cells, whole_map)


def test_signal_is_that_of_the_cell():
    drawn = curves_with(flight(SECONDS, FORWARD, name="pushed.csv")).signal
    assert (drawn.flight, drawn.channel, drawn.unit) == ("pushed.csv", "force_x", "m/s^2")
    np.testing.assert_allclose(drawn.time_s, TIME_S)
    assert drawn.phase.shape == TIME_S.shape and drawn.after is None and drawn.cell == LOWEST


def test_floor_of_the_signal_is_the_root_of_the_summed_squares_of_its_bands_phase_by_phase():
    """3, 4 and 5; that of another channel, of a higher band and of a regime does not count, nor does half a floor."""
    low, second, third = (0.0, 0.5), (0.5, 2.0), (2.0, 6.0)
    floors = [("hover", low, 0.3), ("hover", second, 0.4), ("hover", third, 7.0), ("take-off", low, 0.6),
              ("take-off", second, 0.8), ("landing", low, 0.1)]
    whole_map = [*(cell("force_x", phase, 0.5, floor, band_hz=band) for phase, band, floor in floors),
                 cell("force_y", "hover", 0.5, 9.0), cell("force_x", "hover", 0.5, 9.0, regime="low")]
    phase = np.repeat([KINDS.index(k) for k in ("take-off", "hover", "landing")], len(TIME_S) // 3)
    drawn = curves_with(flight(SECONDS, FORWARD, phase=phase), whole_map=whole_map).signal
    np.testing.assert_allclose(drawn.floor, np.repeat([1.0, 0.5, np.nan], len(TIME_S) // 3))


@pytest.mark.parametrize("band_hz", [(0.0, 0.5), (2.0, 6.0), (25.0, 50.0)])
def test_two_thirds_of_white_noise_at_its_floor_lie_within_the_floor(band_hz):
    """As of any normal variable within one standard deviation: 68 %."""
    flown = [flight(60.0, noise(60.0, 1.0, i) * [1.0, 0.0, 0.0], name=str(i)) for i in range(6)]
    drawn = curves_with(flown[0], cells=[cell("force_x", "hover", 1.0, band_hz=band_hz)],
                        whole_map=gap_map(FLOOR, flown[:1], flown[1:]).cells).signal
    assert np.mean(np.abs(drawn.before) < drawn.floor) == pytest.approx(0.683, abs=0.06)


def test_measured_is_the_model_and_the_gap_together():
    """Of a level hover whose model has no force forward."""
    drawn = curves_with(flight(SECONDS, FORWARD)).signal
    np.testing.assert_allclose(drawn.before, 0.5, atol=1e-9)
    np.testing.assert_allclose(drawn.measured - drawn.before, 0.0, atol=1e-9)


def test_the_gap_after_is_without_what_the_effects_make():
    drawn = curves_with(flight(SECONDS, FORWARD), effects=[bias(0.4)]).signal
    np.testing.assert_allclose(drawn.before, 0.5, atol=1e-9)
    np.testing.assert_allclose(drawn.after, 0.1, atol=1e-9)


@pytest.mark.parametrize(("band_hz", "push_hz", "drawn_hz"), [
    ((0.0, 0.5), 1.0, (0.0, 2.0)), ((0.0, 0.5), 4.0, (0.0, 2.0)), ((0.5, 2.0), 1.0, (0.0, 2.0)),
    ((0.5, 2.0), 4.0, (0.0, 2.0)), ((2.0, 6.0), 4.0, (2.0, 6.0)), ((2.0, 6.0), 9.0, (2.0, 6.0)),
    ((6.0, 12.0), 4.0, (6.0, 12.0)), ((25.0, 50.0), 40.0, (25.0, 50.0)),
    ((0.0, 0.5), 0.5, (0.0, 2.0))])  # at a crossover inside
def test_signal_holds_what_is_in_the_band_that_it_states(band_hz, push_hz, drawn_hz):
    """A push beside a constant one, away from the ends, where the filter lacks one side.

    It is drawn in the cell's band, and up to 2 Hz where that lies below.
    """
    push, share = np.sin(2.0 * np.pi * push_hz * TIME_S), drawn_hz[0] < push_hz < drawn_hz[1]
    pushed_flight = flight(SECONDS, push[:, None] * [1.0, 0.0, 0.0] + FORWARD)
    drawn = curves_with(pushed_flight, cells=[cell("force_x", "hover", 0.5, band_hz=band_hz)]).signal
    inside = slice(300, -300)
    assert drawn.band_hz == drawn_hz
    np.testing.assert_allclose(drawn.before[inside], 0.5 * (drawn_hz[0] == 0.0) + share * push[inside], atol=0.05)


@pytest.mark.parametrize(("channel", "band_hz"), [("rate_x", (0.0, 0.5)), ("force_x", (0.5, 2.0))])
def test_signal_keeps_to_its_own_band_where_the_map_lacks_another_below_2_hz(channel, band_hz):
    """As of rates, whose lowest band alone is judged, and of commands, whose lowest is not: the floor is known."""
    own = cell(channel, "hover", 0.5, 0.2, band_hz=band_hz)
    drawn = curves_with(flight(SECONDS), cells=[own], whole_map=[own]).signal
    assert drawn.band_hz == band_hz and (drawn.floor == 0.2).all()


def test_height_is_drawn_beside_a_ground_effect_alone_and_where_it_is_known():
    flown = flight(SECONDS, FORWARD)
    low = replace(flown, signals=flown.signals.copy(), usable=TIME_S < 10.0)
    low.signals[:, at.HEIGHT] = 0.08
    effect = terms("ground_effect")[0].fitted(np.ones(1))
    height_m = curves_with(low, effects=[effect]).signal.height_m
    np.testing.assert_array_equal(height_m, np.where(low.usable, 0.08, np.nan))
    assert curves_with(low, effects=[bias(0.4)]).signal.height_m is None
    low.signals[:, at.HEIGHT] = 0.0
    assert curves_with(low, effects=[effect]).signal.height_m is None


def test_nothing_is_drawn_where_nothing_is_judged():
    drawn = curves_with(replace(whole_flight := flight(SECONDS, FORWARD), usable=(used := TIME_S < 10.0)))
    assert whole_flight.usable.all()
    np.testing.assert_array_equal(np.isfinite(drawn.signal.before), used)
    np.testing.assert_array_equal(np.isfinite(drawn.signal.measured), used)
    np.testing.assert_array_equal(np.isfinite(drawn.signal.floor), used)


@pytest.mark.parametrize(("band_hz", "constant"), [((0.0, 0.5), 0.5), ((25.0, 50.0), 0.0)])
def test_lost_rows_are_not_drawn_and_change_nothing_beside_them(band_hz, constant):
    """A constant gap, with 50 m/s^2 in the rows that stand for those that were lost."""
    lost = (TIME_S >= 7.0) & (TIME_S < 7.1)
    lossy_flight = flight(SECONDS, np.where(lost[:, None], 50.0, FORWARD), lost=lost)
    drawn = curves_with(lossy_flight, cells=[cell("force_x", "hover", 0.5, band_hz=band_hz)]).signal
    for curve in (drawn.before, drawn.measured):
        assert np.isnan(curve[lost]).all()
        np.testing.assert_allclose(curve[~lost], constant, atol=1e-9)


def test_flight_of_the_signal_is_that_of_the_median_gap():
    """By the rms in the cell's channel; in another channel their order is another."""
    noisy_flights = [flight(SECONDS, noise(SECONDS, 1.0, i) * [forward, 0.0, up], name=str(forward))
            for i, (forward, up) in enumerate([(3.0, 1.0), (1.0, 2.0), (2.0, 3.0)])]
    assert curves_with(*noisy_flights).signal.flight == "2.0"
    assert curves_with(*noisy_flights, cells=[cell("force_z", "hover", 1.0)]).signal.flight == "1.0"


@pytest.mark.parametrize(("band_hz", "flown"), [((0.0, 0.5), "constant 2"), ((0.5, 2.0), "constant 0"),
                                                ((2.0, 6.0), "constant 4")])
def test_the_median_is_that_of_the_gap_in_the_cells_band(band_hz, flown):
    """Of constant gaps with pushes at 1 and 4 Hz, in m/s^2; the noise of all is in an order of its own."""
    def push(constant, slow, fast, i):
        of_axis = constant + slow * np.sin(2.0 * np.pi * TIME_S) + fast * np.sin(8.0 * np.pi * TIME_S)
        return of_axis[:, None] * [1.0, 0.0, 0.0] + noise(SECONDS, 0.1 * i, i)

    pushed = [flight(SECONDS, push(*gaps), name=f"constant {gaps[0]}")
              for gaps in ((2, 0.5, 4.0, 1), (4, 1.5, 3.0, 2), (0, 1.0, 2.0, 3))]
    assert curves_with(*pushed, cells=[cell("force_x", "hover", 1.0, band_hz=band_hz)]).signal.flight == flown


@pytest.mark.parametrize(("phase", "flown"), [("over platform", "0"), ("hover", "3"), ("landing", "1")])
def test_the_median_is_that_of_the_gap_in_the_cells_phase(phase, flown):
    """Of five flights three cross a platform, where their gap is another. None lands: then it is that in the air."""
    crossing = (TIME_S > 6.0) & (TIME_S < 9.0)
    flights = [flight(SECONDS, np.where(crossing, there, elsewhere)[:, None] * [1.0, 0.0, 0.0], name=str(i),
                      phase=np.where(crossing & crosses, KINDS.index("over platform"), KINDS.index("hover")))
               for i, (elsewhere, there, crosses) in enumerate([
                   (0.0, 1.0, True), (2.0, 0.8, True), (1.0, 5.0, True), (1.5, 1.5, False), (9.0, 9.0, False)])]
    assert curves_with(*flights, cells=[cell("force_x", phase, 1.0)]).signal.flight == flown


def test_flight_of_a_passing_effect_is_one_in_which_it_acts():
    """The third of three gaps, where the effect acts in this flight alone; without one that passes it is the second."""
    flights = [flight(SECONDS, noise(SECONDS, rms, i), name=str(rms)) for i, rms in enumerate((1.0, 2.0, 3.0))]
    passing = replace(bias(0.4), gate=(("3.0", 2.0, 4.0),))
    drawn = curves_with(*flights, effects=[passing]).signal
    assert (drawn.flight, drawn.acts_s) == ("3.0", ((2.0, 4.0),))
    assert curves_with(*flights, effects=[bias(0.4)]).signal.flight == "2.0"


@pytest.mark.parametrize(("phase", "gate"), [("hover", (("last", 1.0, 2.0),)), ("landing", ())])
def test_the_one_flight_that_can_be_drawn_is_though_it_is_the_last_of_many(phase, gate):
    """The 41st is the one in which the effect acts, or that lands."""
    phases = np.repeat([KINDS.index("hover"), KINDS.index(phase)], 100)
    flights = [*(flight(2.0, noise(2.0, 1.0, i), name=str(i)) for i in range(40)),
               flight(2.0, FORWARD, name="last", phase=phases)]
    drawn = curves_with(*flights, effects=[replace(bias(0.4), gate=gate)], cells=[cell("force_x", phase, 0.5)]).signal
    assert drawn.flight == "last" and drawn.acts_s == tuple(act[1:] for act in gate) and drawn.after is not None


def test_an_effect_that_changes_no_sample_has_no_curve_after():
    """A bias of 0 and one of 0.4 m/s^2."""
    pushed = flight(SECONDS, FORWARD)
    assert curves_with(pushed, effects=[bias(0.0)]).signal.after is None
    assert curves_with(pushed, effects=[bias(0.4)]).signal.after is not None


def test_flight_without_the_channel_does_not_count_for_the_median():
    """Of three gaps the middle one, though two more flights have no gyro; without any gyro there is no signal."""
    turning = [flight(SECONDS, gyro=noise(SECONDS, rms, i), name=str(rms)) for i, rms in enumerate((0.3, 0.1, 0.2))]
    without_gyro = [replace(flight(SECONDS, name=f"no gyro {i}"), rates=None) for i in range(2)]
    rate = [cell("rate_x", "hover", 1.0)]
    assert curves_with(*turning, *without_gyro, cells=rate).signal.flight == "0.2"
    assert curves_with(*without_gyro, cells=rate).signal is None


@pytest.mark.parametrize(("channel", "gyro", "shown"), [
    ("torque_y", 0.01, True), ("torque_y", None, False), ("rate_x", 0.01, False)])
def test_measured_is_drawn_of_what_a_sensor_shows_alone(channel, gyro, shown):
    """Of torque the slope of the gyro; of rates only the difference to the model is known."""
    turning_flight = flight(SECONDS, gyro=0.0 if gyro is None else noise(SECONDS, gyro, 5))
    if gyro is None:
        turning_flight = replace(turning_flight, rates=None)
    drawn = curves_with(turning_flight, cells=[cell(channel, "hover", 1.0, band_hz=(12.0, 25.0))]).signal
    assert (drawn.measured is not None) is shown
    if shown:
        band = butter(4, (12.0, 25.0), "bandpass", fs=1.0 / PERIOD_S, output="sos")
        pitch = sosfiltfilt(band, angular_acceleration(turning_flight)[:, 1])
        assert np.corrcoef(drawn.measured[100:-100], pitch[100:-100])[0, 1] > 0.95


def test_spectra_are_of_the_cells_channels_each_once_and_the_first_few():
    channels = ["force_z", "force_x", "force_z", "torque_x", "force_y"]
    curves = curves_with(hover(1, length_s=SECONDS), cells=[cell(c, "hover", 1.0) for c in channels])
    assert [s.channel for s in curves.spectra] == ["force_z", "force_x", "torque_x"] and MOST_SPECTRA == 3
    assert [s.unit for s in curves.spectra] == ["m/s^2", "m/s^2", "rad/s^2"]
    np.testing.assert_array_equal(curves.frequency_hz, frequencies(AIR))
    for s in curves.spectra:
        assert s.before.shape == s.floor.shape == curves.frequency_hz.shape and s.after is None


def test_spectrum_before_is_the_mean_power_of_white_noise():
    """2 rms^2 T, one-sided, over blocks of several flights."""
    noisy_flights = [flight(60.0, noise(60.0, rms, 20 + i)) for i, rms in enumerate((0.1, 0.3))]
    (spectrum,) = curves_with(*noisy_flights).spectra
    assert spectrum.before[2:-1].mean() == pytest.approx(2.0 * PERIOD_S * np.mean([0.1 ** 2, 0.3 ** 2]), rel=0.05)


@pytest.mark.parametrize(("blocks", "measured"), [(8, False), (9, True)])
def test_floor_of_a_spectrum_is_the_nominal_power_where_nine_blocks_are_known_and_the_sensors_noise_where_not(
        blocks, measured):
    """Of white noise the power is 2 rms^2 T; nominal flights here have much more than the sensors' own."""
    seconds = {8: 11.6, 9: 12.9}[blocks]
    nominal = flight(seconds, noise(seconds, 0.5, 7))
    assert len(starts(nominal, AIR)) == blocks
    (spectrum,) = curves_with(hover(1, length_s=SECONDS), nominal=[nominal]).spectra
    rms = 0.5 if measured else sensor_noise(VEHICLE)[COLUMN["force_x"]]
    assert spectrum.floor[2:-1].mean() == pytest.approx(2.0 * PERIOD_S * rms ** 2, rel=0.25)


def test_spectra_of_a_nominal_flight_lie_at_their_floor():
    """Of one that is none of those that the floor is of, in every channel: force, torque, rates and commands."""
    *nominal, other = fly(5, 5)
    study = declared_study(VEHICLE, nominal)
    assert study.response is not None
    for channel in CHANNELS:
        (spectrum,) = curves_with(other, nominal=nominal, study=study, cells=[cell(channel.name, "hover", 1.0)]).spectra
        for low, high in ((2.0, 6.0), (6.0, 12.0), (12.0, 25.0)):
            band = (frequencies(AIR) >= low) & (frequencies(AIR) < high)
            assert 0.5 < spectrum.before[band].mean() / spectrum.floor[band].mean() < 2.0, (channel.name, low)


def test_a_command_has_the_floor_of_nominal_flights_and_none_without_them(monkeypatch):
    """The noise of the sensors, which stands for them, is not in a command. Its power here is 2 T."""
    monkeypatch.setattr(Study, "residual", lambda *_: np.random.default_rng(0).normal(size=(len(TIME_S), COUNT)))
    flown, cells = hover(1, length_s=SECONDS), [cell(name, "hover", 1.0) for name in ("force_x", "command_yaw")]
    force, command = curves_with(flown, cells=cells).spectra
    assert force.floor is not None and command.channel == "command_yaw" and command.floor is None
    _, command = curves_with(flown, cells=cells, nominal=[flown]).spectra
    assert command.floor[2:-1].mean() == pytest.approx(2.0 * PERIOD_S, rel=0.25)


def test_spectrum_after_lacks_the_power_of_a_mean_effect():
    (spectrum,) = curves_with(flight(SECONDS, FORWARD), effects=[bias(0.5)]).spectra
    assert spectrum.before[0] > 0.1 and spectrum.after.max() < 1e-9


def test_spectrum_after_a_random_effect_is_near_the_floor():
    """Its samples cannot be predicted: what it leaves is the floor times the ratio of the power to that expected."""
    louder = terms("imu_noise")[0].fitted(np.ones(1))
    factor = louder.values["factor"]
    noisy_flight = hover(1, louder=np.sqrt(1.0 + (factor ** 2 - 1.0) / LOUDNESS ** 2), length_s=120.0)
    curves = curves_with(noisy_flight, effects=[louder], nominal=[hover(2, length_s=120.0)])
    (spectrum,) = curves.spectra
    above = slice(2, -1)
    assert spectrum.before[above].mean() > 1.5 * spectrum.floor[above].mean()
    off = np.abs(spectrum.after - spectrum.floor)[above].mean()
    assert off < 0.3 * (spectrum.before - spectrum.floor)[above].mean()
    assert curves.random and not curves_with(noisy_flight, effects=[bias(0.4)]).random


@pytest.mark.parametrize("name", ["imu_noise", "motor_noise"])
def test_torque_after_noise_is_near_the_floor(name):
    """In a closed loop, where commands answer it and the gyro's response is known: as much as is added is taken off.

    The noise of the motors is a torque from outside, that of the IMU one of the gyro alone.
    """
    nominal, (louder, *_) = fly(4, 5), [t.fitted(np.ones(1)) for t in terms(name)]
    noisy_flights = fly(3, 11, [(name, dict(louder.values))])
    for axis in "xyz":
        (spectrum,) = curves_with(*noisy_flights, nominal=nominal, study=declared_study(VEHICLE, nominal),
                                  effects=[louder], cells=[cell(f"torque_{axis}", "hover", 1.0)]).spectra
        for low, high in ((2.0, 4.5), (4.5, 7.0), (7.0, 12.0), (12.0, 25.0)):
            band = (frequencies(AIR) >= low) & (frequencies(AIR) < high)
            before, after = (p[band].mean() / spectrum.floor[band].mean() for p in (spectrum.before, spectrum.after))
            assert before > 1.1 and 0.75 < after < 1.35, (axis, low, before, after)


def test_lost_rows_add_nothing_to_a_spectrum_that_is_drawn():
    """A constant gap has no power above the means, whatever rows are lost."""
    lost = np.arange(1500) % 100 < 3
    whole, poor = (flight(15.0, FORWARD, lost=rows) for rows in (None, lost))
    power, poorer = (curves_with(f).spectra[0].before for f in (whole, poor))
    assert poorer == pytest.approx(power, abs=1e-9) and power[3:].max() < 1e-9


def test_a_spectrum_is_the_mean_over_the_flights_that_have_its_sensor():
    """One flight of three lacks its gyro: of rates it says nothing, of force as much as the others."""
    one, two, three = (hover(seed, length_s=SECONDS) for seed in (1, 2, 3))
    flown, effects = (one, replace(two, rates=None), three), [terms("imu_noise")[0].fitted(np.ones(1))]
    cells = [cell(channel, "hover", 1.0) for channel in ("force_z", "rate_x")]
    force, turning = curves_with(*flown, cells=cells, effects=effects).spectra
    assert (force.channel, turning.channel) == ("force_z", "rate_x")
    expected = curves_with(one, three, cells=cells, effects=effects).spectra[1]
    np.testing.assert_allclose(turning.before, expected.before)
    np.testing.assert_allclose(turning.after, expected.after)
    np.testing.assert_allclose(force.before, curves_with(one, two, three, cells=cells).spectra[0].before)


def test_without_a_cell_the_commands_are_all():
    curves = curves_with(flight(SECONDS), cells=[])
    assert curves.signal is None and curves.spectra == () and not len(curves.frequency_hz)
    assert curves.commands is not None


def test_commands_of_nominal_flights_are_drawn_where_there_are_any():
    alone = curves_with(flight(SECONDS)).commands
    beside = curves_with(flight(SECONDS), nominal=[flight(SECONDS)]).commands
    assert set(alone.flown) == set(beside.flown) == set(beside.nominal) and not alone.nominal
    for axis, power in beside.flown.items():
        np.testing.assert_array_equal(power, beside.nominal[axis])


def test_without_flights_nothing_is_drawn():
    curves = curves_with()
    assert curves.signal is None and curves.spectra == () and curves.commands is None


def test_a_flight_too_short_for_a_block_has_a_signal_and_no_spectrum():
    curves = curves_with(flight(1.0, FORWARD))
    assert curves.signal is not None and curves.spectra == ()
