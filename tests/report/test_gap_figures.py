"""The plots of a gap report: their panes, lines and labels."""

import re
import unicodedata
from dataclasses import replace
from types import SimpleNamespace

import matplotlib.colors
import numpy as np
import pytest

from airtouch.gap.answer.curves import Signal, Spectrum
from airtouch.logs.segments import KINDS
from airtouch.report import gap_figures, style
from made_diagnosis import cell

TIME_S = np.arange(100) * 0.1
FREQUENCY_HZ = np.linspace(0.0, 50.0, 51)


def lines(ax):
    """The lines of a pane by their labels, each (points,)."""
    return {line.get_label(): line.get_ydata() for line in ax.get_lines()}


def signal(measured=True, after=True, phase=None):
    steps = np.zeros(100, int) if phase is None else phase
    return Signal("a.csv", "force_x", (0.0, 2.0), "m/s^2", TIME_S, steps, np.full(100, 5.0) if measured else None,
                  np.full(100, 2.0), np.full(100, 0.5) if after else None, np.full(100, 0.25))


def test_signal_has_measured_and_models_above_and_their_differences_below():
    above, below = gap_figures.signals(signal()).axes
    assert {name: y[0] for name, y in lines(above).items()} == {"measured": 5.0, "model": 3.0, "model with effect": 4.5}
    assert {name: y[0] for name, y in lines(below).items()} == {"gap before": 2.0, "gap after": 0.5}
    assert "floor" in below.get_legend_handles_labels()[1]
    assert above.get_ylabel() == "forward force\nm/s²" and below.get_xlabel() == "time, s"


def test_the_floor_steps_with_the_phases_and_is_not_drawn_where_it_is_unknown():
    floor = np.repeat([0.25, 1.0, np.nan], [50, 25, 25])
    (ax,) = gap_figures.signals(replace(signal(measured=False), floor=floor)).axes
    (grey,) = ax.collections
    assert not len(grey.get_facecolor()) and grey.get_edgecolor()[0, 3] == 1.0  # lines, that tint no curve
    for inside, point in ((True, (4.0, 0.2)), (False, (4.0, 0.5)), (True, (6.0, -0.9)), (False, (8.0, 0.0))):
        assert any(path.contains_point(point) for path in grey.get_paths()) is inside, point
    (ax,) = gap_figures.signals(replace(signal(measured=False), floor=np.full(100, np.nan))).axes
    assert not ax.collections and "floor" not in ax.get_legend_handles_labels()[1]


@pytest.mark.parametrize("worst", [-9.0, 9.0])
def test_every_curve_is_in_view_where_it_is_largest(worst):
    """The effect named does worst at lift-off, in 2 % of a flight; a spike of a fifth of that sets no scale."""
    before = np.full(1000, 2.0)
    after, spiked = np.zeros(1000), np.zeros(1000)
    after[100:120], spiked[100:104] = worst, worst
    curves = Signal("a.csv", "force_x", (0.0, 2.0), "m/s^2", np.arange(1000) * 0.01, np.zeros(1000, int),
                    np.zeros(1000), before, after, np.full(1000, 4.0))
    for ax in gap_figures.signals(curves).axes:
        low, high = ax.get_ylim()
        for name, curve in lines(ax).items():
            assert low < curve.min() and curve.max() < high, name
    assert gap_figures.signals(curves).axes[1].get_ylim()[0] < -4.0  # of the floor
    for ax in gap_figures.signals(replace(curves, after=spiked)).axes:
        assert np.abs(ax.get_ylim()).max() < 9.0


@pytest.mark.parametrize("size", [0.003, 10.0, 100.0, 1000.0])
def test_no_label_leaves_the_plot(size):
    curve = size * np.sin(TIME_S)
    figure = gap_figures.signals(replace(signal(), measured=3.0 * curve, before=curve, after=-curve))
    figure.draw_without_rendering()
    for ax in figure.axes:
        assert ax.yaxis.label.get_window_extent().x0 >= 0.0


def test_the_gap_before_shows_behind_the_gap_after_where_the_two_are_equal():
    """It is broader, and drawn first."""
    equal = replace(signal(), after=np.full(100, 2.0))
    for ax, before, after in zip(gap_figures.signals(equal).axes, ("model", "gap before"),
                                 ("model with effect", "gap after"), strict=True):
        drawn_lines = {line.get_label(): (i, line.get_linewidth()) for i, line in enumerate(ax.get_lines())}
        assert drawn_lines[before][0] < drawn_lines[after][0]
        assert drawn_lines[before][1] >= 2.0 * drawn_lines[after][1]


@pytest.mark.parametrize("measured", [True, False])
def test_height_is_below_the_signal_of_a_ground_effect(measured):
    figure = gap_figures.signals(replace(signal(measured), height_m=np.full(100, 0.08)))
    *_, gap, height = figure.axes
    assert len(figure.axes) == 2 + measured and set(lines(gap)) == {"gap before", "gap after"}
    assert {y[0] for y in lines(height).values()} == {0.08}
    assert (height.get_ylabel(), height.get_xlabel(), gap.get_xlabel()) == ("height\nm", "time, s", "")


def test_signal_without_a_sensor_has_the_differences_alone_and_without_an_effect_one_line():
    (only,) = gap_figures.signals(signal(measured=False, after=False)).axes
    assert set(lines(only)) == {"gap"} and only.get_ylabel() == "measured - model\nm/s²"


def test_phases_behind_the_signal_have_the_colours_of_its_caption():
    """Take-off and landing alike, over a platform another; hover has none."""
    kinds = ("take-off", "hover", "over platform", "landing")
    phase = np.repeat([KINDS.index(k) for k in kinds], 25)
    (ax,) = gap_figures.signals(signal(measured=False, phase=phase)).axes
    spans = [p for p in ax.patches if p.get_label() != "floor"]
    first, second, third = (p.get_facecolor() for p in spans)
    assert first == third != second
    for span, begin, end in zip(spans, (0, 50, 75), (24, 74, 99), strict=True):
        assert (span.get_x(), span.get_x() + span.get_width()) == pytest.approx((TIME_S[begin], TIME_S[end]))


def test_the_phase_of_the_answers_cell_has_a_bar_in_every_pane():
    """Twice in hover, which is not shaded, at the lower end of the pane."""
    phase = np.repeat([KINDS.index(k) for k in ("hover", "cruise", "hover", "landing")], 25)
    for ax in gap_figures.signals(replace(signal(phase=phase), cell=cell("force_x", "hover", 1.0))).axes:
        bars = [p for p in ax.patches if matplotlib.colors.to_hex(p.get_facecolor()) == style.BLUE]
        assert [(p.get_x(), p.get_x() + p.get_width()) for p in bars] == [
            (TIME_S[0], TIME_S[24]), (TIME_S[50], pytest.approx(TIME_S[74]))]
        assert all(p.get_y() == 0.0 and p.get_height() < 0.1 for p in bars)
    (ax,) = gap_figures.signals(signal(measured=False, after=False)).axes
    assert not ax.patches


def test_no_name_of_a_phase_stands_beside_a_pane_with_other_limits():
    """Nor takes it part in the layout."""
    phase = np.repeat([KINDS.index(k) for k in ("take-off", "over platform", "landing")], [30, 40, 30])
    figure = gap_figures.signals(signal(measured=False, phase=phase))
    (ax,) = figure.axes
    names = {}
    for limits in ((0.0, 9.9), (4.0, 6.0), (4.0, 4.5)):
        ax.set_xlim(limits)
        figure.draw_without_rendering()
        inside = ax.get_window_extent().padded(1.0)
        boxes = {text.get_text(): text.get_tightbbox() for text in ax.texts}
        names[limits] = {name for name, box in boxes.items() if box.width > 0.0}
        assert all(inside.overlaps(boxes[name]) for name in names[limits])
    assert list(names.values()) == [{"take-off", "over platform", "landing"}, {"over platform"}, set()]


@pytest.mark.parametrize("after", [True, False])
def test_spectra_have_a_pane_for_each_channel(after):
    power = np.full(51, 4.0)
    shown = [Spectrum(name, unit, power, power / 2.0 if after else None, power / 4.0)
             for name, unit in (("force_x", "m/s^2"), ("torque_z", "rad/s^2"))]
    figure = gap_figures.spectra(FREQUENCY_HZ, shown)
    assert [(ax.get_title(loc="left"), ax.get_ylabel()) for ax in figure.axes] == [
        ("forward force", "(m/s²)²/Hz"), ("yaw torque", "(rad/s²)²/Hz")]
    expected = {"floor": 1.0, "before": 4.0, "after": 2.0} if after else {"floor": 1.0, "gap": 4.0}
    for ax in figure.axes:
        assert {name: y[0] for name, y in lines(ax).items()} == expected
    assert figure.axes[-1].get_xlabel() == "frequency, Hz"
    assert [text.get_text() for text in figure.legends[0].get_texts()] == list(expected)


def test_powers_are_labelled_in_plain_text():
    """Without formulas, whose parser takes a second to begin."""
    power = np.geomspace(1e-12, 1e3, 51)
    (ax,) = gap_figures.spectra(FREQUENCY_HZ, [Spectrum("force_x", "m/s^2", power, None, power)]).axes
    for y, label in zip(ax.get_yticks(), ax.get_yticklabels(), strict=True):
        sign, digits = re.fullmatch("10(⁻?)(.+)", label.get_text()).groups()
        exponent = int("".join(str(unicodedata.digit(c)) for c in digits))
        assert (-exponent if sign else exponent) == round(np.log10(y))
    assert len(ax.get_yticks()) > 2


def test_ticks_that_a_user_sets_have_true_labels():
    power = np.geomspace(1e-4, 1e-1, 51)
    (ax,) = gap_figures.spectra(FREQUENCY_HZ, [Spectrum("force_x", "m/s^2", power, None, power)]).axes
    ax.set_yticks([1e-3, 2e-3, 5.5e-3, 2e-2])
    ax.set_xticks([3.0, 30.0])
    labels = [[t.get_text() for t in axis.get_ticklabels()] for axis in (ax.xaxis, ax.yaxis)]
    assert labels == [["3", "30"], ["10⁻³", "2·10⁻³", "5.5·10⁻³", "2·10⁻²"]]


@pytest.mark.parametrize(("limits", "expected"), [
    ((1e-3, 1e-1), [1e-3, 1e-2, 1e-1]), ((1e-1, 1e-3), [1e-3, 1e-2, 1e-1]), ((1.5e-3, 6e-3), [2e-3, 5e-3]),
    ((1e-2, 9e-2), [1e-2, 2e-2, 5e-2]), ((1e-3, 1e5), [1e-3, 1e0, 1e3]),
    ((1.1e-3, 9e-2), [2e-3, 1e-2, 5e-2]), ((2.1e-3, 4.1e-3), [3e-3, 4e-3])])
def test_an_axis_of_power_has_labels_within_the_limits_that_a_user_sets(limits, expected):
    power = np.geomspace(1e-8, 1e3, 51)
    (ax,) = gap_figures.spectra(FREQUENCY_HZ, [Spectrum("force_x", "m/s^2", power, None, power)]).axes
    ax.set_ylim(limits)
    assert shown_ticks(ax.yaxis, limits) == pytest.approx(expected)


@pytest.mark.parametrize(("limits", "expected"), [
    ((2.0, 20.0), [2.0, 5.0, 10.0, 20.0]), ((11.0, 19.0), [12.0, 14.0, 16.0, 18.0]), ((0.1, 0.3), [0.1, 0.2])])
def test_a_frequency_axis_has_labels_within_the_limits_that_a_user_sets(limits, expected):
    """Of all panes, which share it."""
    power = np.geomspace(1e-8, 1e3, 51)
    axes = gap_figures.spectra(FREQUENCY_HZ, [Spectrum("force_x", "m/s^2", power, None, power)] * 2).axes
    axes[0].set_xlim(limits)
    for ax in axes:
        assert shown_ticks(ax.xaxis, limits) == pytest.approx(expected)


def shown_ticks(axis, limits):
    """Places of the ticks of an axis between its limits, those with labels."""
    axis.figure.draw_without_rendering()
    low, high = sorted(limits)
    return [tick.get_loc() for tick in axis.get_major_ticks()
            if tick.label1.get_text() and 0.999 * low <= tick.get_loc() <= 1.001 * high]


def test_a_spectrum_without_a_floor_has_no_line_for_it_and_the_legend_names_that_of_the_others():
    power = np.full(51, 4.0)
    shown = [Spectrum("command_yaw", "N", power, None, None), Spectrum("force_x", "m/s^2", power, None, power / 4.0)]
    figure = gap_figures.spectra(FREQUENCY_HZ, shown)
    assert [set(lines(ax)) for ax in figure.axes] == [{"gap"}, {"gap", "floor"}]
    assert [ax.get_ylabel() for ax in figure.axes] == ["N²/Hz", "(m/s²)²/Hz"]
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["floor", "gap"]


@pytest.mark.parametrize(("least", "most"), [
    (2e-9, 7e-9), (3.0, 3.0), (5e-10, 5e-9), (9e-7, 1.1e-4), (1e-12, 1e-12), (1e-2, 1e-1), (1e-11, 1e-6), (1e-12, 1e9)])
def test_two_powers_at_least_can_be_read_and_no_more_than_fit(least, most):
    """Of the labels in view; the data stay in view too, and take half of the pane where they span a decade."""
    power = np.geomspace(least, most, 51)
    (ax,) = gap_figures.spectra(FREQUENCY_HZ, [Spectrum("force_x", "m/s^2", power, None, power)]).axes
    low, high = ax.get_ylim()
    labels = [t.get_text() for y, t in zip(ax.get_yticks(), ax.get_yticklabels(), strict=True) if low <= y <= high]
    assert 2 <= len(set(labels)) == len(labels) <= 5
    assert low <= least and most <= high
    assert np.log10(most / least) < 1.0 or np.log10(high / low) < 2.0 * np.log10(most / least)


@pytest.mark.parametrize("nominal", [{}, {"roll": np.ones(5), "yaw": np.ones(5)}])
def test_commands_have_a_pane_for_each_axis_and_nominal_flights_beside(nominal):
    curves = SimpleNamespace(frequency_hz=np.arange(1.0, 6.0), flown={"roll": np.full(5, 2.0), "yaw": np.full(5, 3.0)},
                             nominal=nominal)
    figure = gap_figures.commands(curves)
    assert [ax.get_title(loc="left") for ax in figure.axes] == ["roll command", "yaw command"]
    for ax, power in zip(figure.axes, (2.0, 3.0), strict=True):
        assert lines(ax)["these flights"][0] == power
        assert ("baseline flights" in lines(ax)) is bool(nominal)
