"""Figures as files: of their own size, the same wherever they are made, and without pyplot."""

import xml.etree.ElementTree as ElementTree

import matplotlib
import matplotlib.image
import numpy as np
import pytest
from matplotlib.backends.backend_pdf import PdfPages

from airtouch.errors import AirTouchError
from airtouch.report import style

SIZE_IN = (4.0, 3.0)


def drawn(room=None):
    """A plot of one curve, in the style of all plots."""
    with style.style():
        figure, ((ax,),) = style.panes(SIZE_IN, room=room)
        ax.plot([0.0, 1.0], [2.0, 3.0])
        ax.set(xlabel="time, s", ylabel="height, m")
    return figure


@pytest.mark.parametrize(("form", "first"), [("png", b"\x89PNG\r\n\x1a\n"), ("svg", b"<?xml"), ("pdf", b"%PDF-")])
def test_equal_figures_are_equal_files_of_the_format(form, first):
    data = style.image(drawn(), form)
    assert data.startswith(first) and data == style.image(drawn(), form)
    assert style.image(drawn(), "png") != style.image(drawn(style.Room(1.0, 0.5, 0.3)), "png")


def test_a_vector_file_has_the_size_of_the_figure_and_its_text_as_glyphs_that_journals_take():
    """72 points an inch. Some journals refuse fonts of type 3, the default of matplotlib."""
    root = ElementTree.fromstring(style.image(drawn(), "svg"))
    assert (root.get("width"), root.get("height")) == ("288pt", "216pt")
    pdf = style.image(drawn(), "pdf")
    assert b"/MediaBox [ 0 0 288 216 ]" in pdf and b"/FontFile2" in pdf and b"/Type3" not in pdf


def test_a_pdf_that_its_user_saves_has_no_font_of_type_3(tmp_path):
    """Nor one that is restyled first. An SVG with text as text, which a user asks for, stays so."""
    figure = drawn()
    figure.axes[0].set_title("other")
    figure.savefig(tmp_path / "a.pdf", bbox_inches="tight")
    pdf = (tmp_path / "a.pdf").read_bytes()
    assert b"/FontFile2" in pdf and b"/Type3" not in pdf
    with matplotlib.rc_context({"svg.fonttype": "none"}):
        figure.savefig(tmp_path / "a.svg")
    assert "other</text>" in (tmp_path / "a.svg").read_text()


@pytest.mark.parametrize(("kind", "two_bytes"), [(3, False), (42, True)])
def test_pages_of_a_pdf_are_written_in_the_fonts_that_are_set_there(kind, two_bytes, tmp_path):
    """Fonts are stored when the file is closed. Text of TrueType has two bytes a letter, which is wrong in another."""
    with matplotlib.rc_context({"pdf.fonttype": kind, "pdf.compression": 0}), PdfPages(tmp_path / "a.pdf") as pages:
        pages.savefig(drawn())
    lines = [x for x in (tmp_path / "a.pdf").read_bytes().splitlines() if x.endswith((b"Tj", b"TJ"))]
    assert lines and any(b"(\0" in x for x in lines) == two_bytes


@pytest.mark.parametrize("room", [None, style.Room(0.5, 0.5, 0.3)])
def test_a_figure_that_is_saved_by_its_user_looks_as_in_the_page(room):
    """Ticks are made when a figure is saved, as many as fit: with a larger font there would be fewer."""
    ticks = []
    for size in (9.0, 40.0):
        figure = drawn(room)
        with matplotlib.rc_context({"font.size": size}):
            figure.draw_without_rendering()
            (ax,) = figure.axes
            ticks.append([(t.get_text(), t.get_fontsize()) for axis in (ax.xaxis, ax.yaxis)
                          for t in axis.get_ticklabels()])
    assert len(ticks[0]) > 8 and ticks[0] == ticks[1]


@pytest.mark.parametrize(("name", "first"), [("a.svg", b"<?xml"), ("a.PDF", b"%PDF-"), ("a.png", b"\x89PNG")])
def test_the_ending_of_a_file_is_its_format(name, first, tmp_path):
    style.write_image(drawn(), tmp_path / name)
    assert (tmp_path / name).read_bytes().startswith(first)
    with pytest.raises(AirTouchError, match="--force"):
        style.write_image(drawn(), tmp_path / name)
    style.write_image(drawn(), tmp_path / name, force=True)


@pytest.mark.parametrize("name", ["a.eps", "a.jpg", "a", "png"])
def test_a_file_of_another_ending_is_refused(name, tmp_path):
    with pytest.raises(AirTouchError, match=r"\.png, \.svg or \.pdf"):
        style.write_image(drawn(), tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_panes_of_a_fixed_layout_leave_the_room_that_was_asked_for():
    room = style.Room(left_in=1.0, below_in=0.5, above_in=0.25, right_in=0.5, top_in=0.25)
    figure, axes = style.panes(SIZE_IN, 2, 1, room)
    (upper,), (lower,) = axes
    assert np.multiply(lower.get_position().min, SIZE_IN) == pytest.approx((1.0, 0.5))
    assert np.multiply(upper.get_position().max, SIZE_IN) == pytest.approx((3.5, 2.5))
    between = (upper.get_position().y0 - lower.get_position().y1) * SIZE_IN[1]
    assert between == pytest.approx(0.25) and upper.get_shared_x_axes().joined(upper, lower)


def test_a_figure_of_another_size_leaves_its_labels_the_same_room():
    """In inches; at a size without place for a pane nothing fails."""
    figure, axes = style.panes(SIZE_IN, 2, 1, style.Room(left_in=1.0, below_in=0.5, above_in=0.25, right_in=0.5))
    for size in ((8.0, 6.0), (2.0, 1.5)):
        figure.set_size_inches(*size)
        (upper,), (lower,) = axes
        assert np.multiply(lower.get_position().min, size) == pytest.approx((1.0, 0.5))
        assert np.multiply(upper.get_position().max, size) == pytest.approx((size[0] - 0.5, size[1] - 0.25))
        assert (upper.get_position().y0 - lower.get_position().y1) * size[1] == pytest.approx(0.25)
    for size in ((1.4, 1.5), (2.0, 0.9), (0.1, 0.1)):
        figure.set_size_inches(size)
        assert style.image(figure)


def marks(ax, marker):
    """Places in x of the marks at an edge of the pane, rounded to samples."""
    return [round(ax.transData.inverted().transform(point)[0])
            for line in style.marks_outside(ax) if line.get_marker() == marker
            for point in line.get_transform().transform(line.get_xydata())]


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_where_a_curve_leaves_its_pane_a_mark_shows_its_farthest_point(sign):
    """Twice above by 3 samples of 2000, the second beside a gap, once below by one; at 11, 21 and 31 they are
    farthest."""
    y = np.sin(np.arange(2000))
    y[10:13], y[20:23], y[31], y[23:26] = (5.0, 9.0, 5.0), (5.0, 8.0, 6.0), -9.0, np.nan
    _, ((ax,),) = style.panes(SIZE_IN)
    ax.plot(np.arange(2000), sign * y, color="red")
    style.limit(ax, sign * y)
    low, high = ax.get_ylim()
    assert -5.0 < low < -1.0 and 1.0 < high < 5.0
    above, below = ("^", "v") if sign > 0.0 else ("v", "^")
    assert (marks(ax, above), marks(ax, below)) == ([11, 21], [31])
    ends = {marker: ax.transAxes.inverted().transform(line.get_transform().transform(line.get_xydata()))[:, 1]
            for line in style.marks_outside(ax) for marker in (line.get_marker(),)}
    assert set(ends["^"]) == {1.0} and set(ends["v"]) == {0.0}
    assert {line.get_color() for line in style.marks_outside(ax)} == {"red"}


def test_a_curve_within_its_pane_has_no_mark():
    _, ((ax,),) = style.panes(SIZE_IN)
    ax.plot(np.sin(np.arange(2000)))
    style.limit(ax, np.sin(np.arange(2000)))
    assert not style.marks_outside(ax)


@pytest.mark.parametrize(("limits", "above", "below"), [
    ((-10.0, 10.0), [], []), ((-10.0, 5.0), [50], []), ((10.0, -4.0), [80], []), ((10.0, -10.0), [], []),
    ((-4.0, 5.0), [50], [80])])
def test_marks_are_those_of_the_limits_that_the_user_sets(limits, above, below):
    """Of a spike up and one down; also upside down. A line across the whole pane leaves it nowhere."""
    y = np.where(np.arange(1000) == 50, 8.0, np.where(np.arange(1000) == 80, -6.0, np.sin(np.arange(1000))))
    figure, ((ax,),) = style.panes(SIZE_IN)
    ax.plot(y)
    style.limit(ax, y)
    ax.axvline(500.0, color="black")
    ax.set_ylim(limits)
    assert (marks(ax, "^"), marks(ax, "v")) == (above, below)
    ax.autoscale()
    figure.draw_without_rendering()
    assert (marks(ax, "^"), marks(ax, "v")) == ([], []) and max(ax.get_ylim()) > 8.0


def drawn_marks(figure):
    """Places of the marks in the SVG of a figure, as fractions of its one pane."""
    name = "{http://www.w3.org/2000/svg}"
    root = ElementTree.fromstring(style.image(figure, "svg"))
    points = [(float(use.get("x")), float(root.get("height").removesuffix("pt")) - float(use.get("y")))
              for group in root.iter(f"{name}g") if group.get("id") == style.MARK for use in group.iter(f"{name}use")]
    (x0, y0), (x1, y1) = figure.axes[0].get_position().get_points() * figure.get_size_inches() * 72.0
    return [((x - x0) / (x1 - x0), (y - y0) / (y1 - y0)) for x, y in points]


def spiked(scale="linear", room=None):
    """A figure of a sine with a spike up at 50 and one down at 700, all of it over 0."""
    y = 20.0 + np.sin(np.arange(1000))
    y[50], y[700] = 400.0, 1.0
    with style.style():
        figure, ((ax,),) = style.panes(SIZE_IN, room=room)
        ax.plot(y)
        style.limit(ax, y)
        ax.margins(x=0)
        ax.set_yscale(scale)
    return figure


@pytest.mark.parametrize("scale", ["linear", "log"])
@pytest.mark.parametrize("room", [None, style.Room(0.5, 0.5, 0.3)])
@pytest.mark.parametrize(("x_limits", "y_limits", "places"), [
    ((0, 100), None, [(0.5, 1.0)]), ((100, 0), None, [(0.5, 1.0)]), ((400, 500), None, []),
    ((0, 1000), None, [(0.05, 1.0), (0.7, 0.0)]), ((25, 75), (2.0, 1.0), [(0.5, 0.0)])])
def test_marks_are_at_the_edges_of_the_pane_whatever_its_limits(scale, room, x_limits, y_limits, places):
    """The last has the whole curve below a pane that is upside down; the spike is farthest."""
    figure = spiked(scale, room)
    (ax,) = figure.axes
    ax.set(xlim=x_limits, **({"ylim": y_limits} if y_limits else {}))
    assert sorted(drawn_marks(figure)) == [pytest.approx(place, abs=0.002) for place in places]
    assert drawn_marks(figure) == drawn_marks(figure)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("limits", [(400, 500), (0, 20)])
def test_a_figure_with_other_limits_keeps_its_size(limits, tmp_path):
    """Trimmed to what is drawn, within 0.1 inch, as labels of ticks may stick out."""
    widths = []
    for name, chosen in (("all.png", (0, 1000)), ("zoomed.png", limits)):
        figure = spiked()
        figure.axes[0].set_xlim(chosen)
        figure.savefig(tmp_path / name, bbox_inches="tight")
        widths.append(matplotlib.image.imread(tmp_path / name).shape[1] / figure.dpi)
    assert widths[0] == pytest.approx(widths[1], abs=0.1) and widths[0] <= SIZE_IN[0] + 0.25


def test_a_line_that_is_hidden_or_removed_has_no_mark():
    figure = spiked()
    (line,) = figure.axes[0].get_lines()
    assert len(drawn_marks(figure)) == 2
    line.set_visible(False)
    assert not drawn_marks(figure)
    line.set_visible(True)
    line.remove()
    assert not drawn_marks(figure)
