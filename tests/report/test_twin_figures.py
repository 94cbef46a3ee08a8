"""The plots of a twin: a pane a channel with its unit, a curve for the recorded and one for the simulated flights."""

import numpy as np
import pytest

from airtouch.report import twin_figures
from airtouch.report.style import BLUE, GREEN, image
from airtouch.twin.comparison.curves import AFTER, BEFORE, AroundEdges, Signals
from airtouch.twin.recorded.channels import DOWN, NAMES, UNITS
from airtouch.twin.recorded.features import BANDS_HZ

RECORDED, SIMULATED = 1.0, 5.0  #: first value of the first channel


def levels(first, *shape):
    """Values (*shape, channels) that are constant in a channel, and one more in each next."""
    return np.zeros((*shape, 1)) + first + np.arange(len(NAMES))


def quartiles(first, points):
    """Quartiles (3, points, channels) of the levels: half a unit below and above the median."""
    return levels(first, 3, points) + np.array([-0.5, 0.0, 0.5])[:, None, None]


def medians(ax):
    """The height of each curve by its colour; without the line at the edge."""
    return {line.get_color(): line.get_ydata()[0] for line in ax.get_lines() if line.get_color() in (GREEN, BLUE)}


def bands(ax):
    """Lowest and highest value of each band of quartiles."""
    return [(band.get_paths()[0].vertices[:, 1].min(), band.get_paths()[0].vertices[:, 1].max())
            for band in ax.collections]


def test_every_channel_of_both_flights_is_overlaid_with_its_unit():
    time_s = np.linspace(-2.0, 8.0, 50)
    figure = twin_figures.overlaid(tuple(Signals(time_s, levels(v, 50)) for v in (RECORDED, SIMULATED)))
    panes = {ax.get_title(loc="left"): ax for ax in figure.axes}
    assert set(panes) == {f"{name}, {unit}" for name, unit in zip(NAMES, UNITS, strict=True)}
    for k, (name, unit) in enumerate(zip(NAMES, UNITS, strict=True)):
        assert medians(panes[f"{name}, {unit}"]) == {GREEN: RECORDED + k, BLUE: SIMULATED + k}
    assert sum(ax.get_xlabel() == "s after the entry" for ax in figure.axes) == 2  # below both columns
    assert [t.get_text() for t in figure.axes[0].get_legend().get_texts()] == ["recorded", "simulated"]


def test_each_kind_of_edge_has_a_column_and_its_quartiles():
    around = {kind: tuple(AroundEdges(quartiles(v + shift, BEFORE + AFTER), n) for v, n in ((RECORDED, 7),
                                                                                           (SIMULATED, 9)))
              for kind, shift in (("entry", 0.0), ("exit", 100.0))}
    figure = twin_figures.edges(around)
    panes = {ax.get_title(loc="left"): ax for ax in figure.axes}
    assert len(panes) == 2 * len(NAMES)
    for k, (name, unit) in enumerate(zip(NAMES, UNITS, strict=True)):
        for kind, shift in (("entry", 0.0), ("exit", 100.0)):
            ax = panes[f"{kind}: {name}, {unit}"]
            assert medians(ax) == {GREEN: RECORDED + shift + k, BLUE: SIMULATED + shift + k}
            assert bands(ax) == [(m - 0.5, m + 0.5) for m in (RECORDED + shift + k, SIMULATED + shift + k)]
    legend = [t.get_text() for t in figure.axes[0].get_legend().get_texts()]
    assert legend == ["recorded, 7 flights", "simulated, 9 flights"]
    assert figure.axes[0].get_lines()[0].get_xdata()[BEFORE] == 0.0  # s: the edge


def test_spectra_have_a_pane_a_channel_and_a_tick_a_band():
    pair = tuple(quartiles(v, len(BANDS_HZ)).transpose(0, 2, 1)[:, :DOWN] for v in (RECORDED, SIMULATED))
    figure = twin_figures.spectra(pair)
    shown = [ax for ax in figure.axes if ax.axison]
    assert [ax.get_title(loc="left") for ax in shown] == [f"{name}, dB" for name in NAMES[:DOWN]]
    for k, ax in enumerate(shown):
        assert medians(ax) == {GREEN: RECORDED + k, BLUE: SIMULATED + k}
        assert bands(ax) == [(v + k - 0.5, v + k + 0.5) for v in (RECORDED, SIMULATED)]
    for ax in shown[-3:]:  # the lowest of each column
        assert ax.get_xlabel() == "Hz" and len(ax.get_xticks()) == len(BANDS_HZ)


@pytest.mark.parametrize("form", ["svg", "pdf"])
def test_a_twins_plot_can_be_saved_without_pixels(form):
    figure = twin_figures.overlaid(tuple(Signals(np.arange(50.0), levels(v, 50)) for v in (RECORDED, SIMULATED)))
    data = image(figure, form)
    assert len(data) > 10_000 and b"<image" not in data and b"/Subtype /Image" not in data
