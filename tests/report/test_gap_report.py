"""The gap report: self-contained, well formed, the answer first, every figure of the diagnosis in it and none of its
own."""

import re
from dataclasses import replace
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

import airtouch
import made_diagnosis
from airtouch.cli.gap import show
from airtouch.errors import AirTouchError
from airtouch.gap.answer import advice
from airtouch.gap.answer.sentences import sentences
from airtouch.gap.flights.flight import ready
from airtouch.gap.measurement import curves_of_measurement, measure
from airtouch.gap.nominal.build_study import declared_study
from airtouch.gap.result import FITTED, HELD_OUT, Closure, NamedEffect, OpenCell, Quantity, Rejected
from airtouch.gap.signatures.candidates import term_of
from airtouch.gap.where import summary
from airtouch.gap.where.gap_map import gap_map
from airtouch.logs.segments import KINDS
from airtouch.report import gap_report, gap_tables
from airtouch.simulation.effects import EFFECTS
from html_page import PageReader
from made_diagnosis import VEHICLE, cell, diagnosis, of_flights


@pytest.fixture(scope="module")
def pushed_flights():
    return made_diagnosis.fly_pushed()


def checked(path):
    source = path.read_text()
    page = PageReader()
    page.feed(source)
    inside = {v for v in page.loaded if v.startswith("#")}
    assert not page.open and all(v.startswith("data:image/png;base64,") for v in set(page.loaded) - inside)
    assert all(f'id="{v[1:]}"' in source for v in inside), inside
    assert "http" not in re.sub(r"base64,[^\"]*", "", source) and "<script" not in source and "viewport" in source
    return " ".join(" ".join(page.text).split()), page


def test_page_of_a_diagnosis(pushed_flights, tmp_path):
    path, result = tmp_path / "gap.html", of_flights(pushed_flights)
    gap_report.write_diagnosis(path, result, command="airtouch gap diagnose <x>")
    text, page = checked(path)
    where, which, how_far = sentences(result)
    assert result.headline.channel == "force_x" and "forward force at 0-0.5 Hz" in where
    assert "imu bias (probability 93%)" in which and "takes away 90% (80% to 95%)" in how_far
    answer = [text.index(s) for s in (where, which, how_far)]
    assert answer == sorted(answer)
    order = [text.index(s) for s in (how_far, "What to do next", "The largest cells", "still be the wrong one")]
    assert order == sorted(order)
    for part in ("93.0%", "0.80 to 0.95", "mass and thrust_coefficient", "Weigh the <vehicle>.", "a note",
                 "no velocity",
                 "wrong effect: wind", "imu_bias, vehicle as declared", "airtouch gap diagnose <x>",
                 "another fits better", "airtouch collect --mission hover", "yaw command is not drawn",
                 "count only the nats beyond the scatter of nominal flights"):
        assert part in text, part
    assert sum(v.startswith("data:") for v in page.loaded) == 3
    assert "random effect" not in text  # a bias of the IMU is none
    with pytest.raises(AirTouchError, match="--force"):
        gap_report.write_diagnosis(path, result, command="x")


def test_the_curve_of_a_random_effect_is_explained_where_one_is_named(pushed_flights, tmp_path):
    noise = NamedEffect("imu_noise", {"factor": Quantity(2.0)})
    gap_report.write_diagnosis(tmp_path / "gap.html", of_flights(pushed_flights[:1], (noise,)), command="x")
    text, _ = checked(tmp_path / "gap.html")
    assert "A random effect cannot be predicted sample by sample" in text
    assert "is random and has no mean in this channel" in text and "hold the mean alone" not in text


def test_only_phases_that_are_drawn_are_explained(pushed_flights, tmp_path):
    """The flights hover alone; with take-off among their phases it is."""
    result = of_flights(pushed_flights)
    signal = replace(result.curves.signal, phase=np.full(len(result.curves.signal.time_s), KINDS.index("hover")))
    hover = replace(result, curves=replace(result.curves, signal=signal))
    rising = replace(result, curves=replace(result.curves, signal=replace(
        signal, phase=np.full(len(signal.time_s), KINDS.index("take-off")), acts_s=((1.0, 2.0),))))
    texts = []
    for name, one in (("hover", hover), ("rising", rising)):
        gap_report.write_diagnosis(tmp_path / f"{name}.html", one, command="x")
        texts.append(checked(tmp_path / f"{name}.html")[0])
    assert not any(word in texts[0] for word in ("Light blue:", "Yellow:", "Green bar:"))
    bars = [re.findall(r"Blue bar: the phase of the answer's cell \(([^)]*)\)", text) for text in texts]
    assert bars == [["in hover, 0-0.5 Hz, forward force"], []]
    assert "Light blue: take-off and landing." in texts[1] and "Green bar: the effect acts." in texts[1]


def test_captions_say_what_before_and_after_are_where_there_is_an_after(pushed_flights, tmp_path):
    """Below the signal and below the spectra."""
    result = of_flights(pushed_flights[:1])
    signal, spectra = result.curves.signal, result.curves.spectra
    alone = replace(result.curves, signal=replace(signal, after=None),
                    spectra=tuple(replace(s, after=None) for s in spectra))
    for curves, times in ((result.curves, 2), (replace(alone, signal=signal), 1), (replace(alone, spectra=spectra), 1),
                          (alone, 0)):
        gap_report.write_diagnosis(tmp_path / "gap.html", replace(result, curves=curves), command="x", force=True)
        text, _ = checked(tmp_path / "gap.html")
        assert text.count("without and with the named effects in the model") == times
        assert "if there are more than 40, over 40 of them, first those that have the phase of the answer's" in text
        assert ("first those in which a named passing effect acts" in text) is (curves.spectra[0].after is not None)


def test_a_floor_of_the_spectra_is_explained_where_one_is_drawn(pushed_flights, tmp_path):
    result = of_flights(pushed_flights[:1])
    bare = replace(result.curves, spectra=tuple(replace(s, floor=None) for s in result.curves.spectra))
    for one, explained in ((result, True), (replace(result, curves=bare), False)):
        gap_report.write_diagnosis(tmp_path / "gap.html", one, command="x", force=True)
        text, _ = checked(tmp_path / "gap.html")
        assert ("Floor: the same of the baseline flights" in text) is explained
        assert "The lowest frequency holds" in text


def test_no_plot_of_an_earlier_result_stays_among_those_that_replace_it(pushed_flights, tmp_path):
    curves = of_flights(pushed_flights[:1]).curves
    (tmp_path / "signal_of_mine.svg").touch()
    assert len(gap_report.write_plots(tmp_path, curves)) == 6
    with pytest.raises(AirTouchError, match="--force"):
        gap_report.write_plots(tmp_path, curves)
    files = gap_report.write_plots(tmp_path, replace(curves, signal=None, spectra=()), force=True)
    names = {"commands.svg", "commands.pdf"}
    assert {f.name for f in files} == names and {f.name for f in tmp_path.iterdir()} == names | {"signal_of_mine.svg"}


def test_no_text_stands_twice_and_the_headlines_cell_is_marked_once(pushed_flights, tmp_path):
    path, result = tmp_path / "gap.html", of_flights(pushed_flights)
    gap_report.write_diagnosis(path, result, command="x")
    source = path.read_text()
    for s in (*sentences(result), result.advice):
        assert source.count(s.replace("<", "&lt;").replace(">", "&gt;")) == 1, s
    assert source.count('<td class="headline"') == 1 and source.count('<tr class="headline"') == 1
    title = re.search(r'<td class="headline"[^>]*title="([^"]*)"', source).group(1)
    assert title.startswith(gap_tables.in_words(result.headline))


def test_the_list_of_the_largest_cells_says_that_the_answers_cell_is_inside_its_floor_and_what_orders_the_others():
    """The gap 0.1 begins at 0.09, its floor of 0.1 ends at 0.12; the gap of 1 begins at 0.9."""
    inside, outside = cell("force_x", "hover", 0.1), cell("force_z", "hover", 1.0)
    note = gap_tables.order_of_largest([inside, outside], inside)
    assert "answer, which does not stand out from its floor." in note and "lower end of the gap's interval" in note
    assert "which does not" not in gap_tables.order_of_largest([outside, inside], outside)
    assert gap_tables.order_of_largest([outside]).startswith("The cells stand out")
    assert gap_tables.order_of_largest([replace(outside, low=None, high=None)]) == ""


def test_cells_without_an_interval_have_colours_by_the_count_above_them(tmp_path):
    """As those of flights without a gyro: one gap is above its floor, one is not, and neither has blocks."""
    bare = {"low": None, "high": None, "floor_high": None, "blocks": 0}
    cells = [replace(cell(channel, "hover", gap), **bare) for channel, gap in (("force_z", 0.3), ("torque_x", 0.05))]
    gap_report.write_diagnosis(tmp_path / "gap.html", diagnosis(cells, "unknown", ()), command="x")
    source = (tmp_path / "gap.html").read_text()
    grey = re.findall(rf'<td[^>]* style="background:{gap_tables.AT_FLOOR.background}[^>]*>([^<]*)', source)
    assert "1 of 2 cells over the floor" in source and grey == ["0.5×"]
    titles = re.findall(r'<td[^>]* title="([^"]*)"', source)
    assert "The blue row is the cell of the answer." in source
    assert len(titles) == 2 and all(t.endswith("floor 0.1 m/s^2, 1 flight") for t in titles), titles
    assert "interval" not in source.split('id="where"')[1].split("</table>")[0]


def test_grey_is_explained_so_that_it_holds_for_a_cell_wholly_below_its_floor(tmp_path):
    """The gap is 0.045 to 0.055 where the floor is 0.1 to 0.12: the two do not overlap."""
    gap_report.write_diagnosis(tmp_path / "gap.html", diagnosis([cell("torque_x", "hover", 0.05)], "none", ()),
                               command="x")
    source = (tmp_path / "gap.html").read_text()
    assert gap_tables.AT_FLOOR.background in source.split('class="map"')[1]
    assert "overlap" not in source and "not surely above their floor" in source


def test_sentences_json_and_page_have_the_same_shrink(pushed_flights, tmp_path):
    """Sentence, JSON and page have one shrink and one before and after; the calibrated arm is left out."""
    result = of_flights(pushed_flights)
    result = replace(result, arms={"declared": Closure(5.0, 2.0, Quantity(0.7)),
                                   "calibrated": Closure(4.0, 1.3, result.shrink)})
    fields = result.plain()
    assert fields["shrink"] == fields["ranking"][0]["shrink"] and fields["gap"]["before"] == 4.0
    assert "from 4 to 1.3 times the floor" in sentences(result)[2]
    assert [r["shrink"] for r in gap_tables.ranking_rows(result)] == ["0.90", "0.00", "-", "-"], "- was not measured"
    rows = gap_tables.how_far_rows(result)
    assert [r["name"] for r in rows] == ["imu_bias", "wrong effect: wind", "imu_bias, vehicle as declared"]
    # the row that starts from another gap says why
    assert [r["why"] for r in rows] == ["", "", gap_tables.OTHER_START]
    page = tmp_path / "gap.html"
    gap_report.write_diagnosis(page, result, command="x")
    assert page.read_text().count(gap_tables.OTHER_START) == 1


def test_phases_are_folded_by_importance(tmp_path):
    cells = [cell("force_z", "take-off", 2.6, blocks=1),
             *(cell("force_y", p, 1.0, blocks=40) for p in ("hover", "cruise")), cell("force_z", "landing", 0.05)]
    maps = gap_tables.maps(cells, summary.headline(cells))
    assert [m["name"] for m in maps] == ["In hover", "In cruise", "At take-off", "At landing"]
    assert [m["open"] for m in maps] == [True, False, False, False]
    gap_report.write_diagnosis(tmp_path / "gap.html", diagnosis(cells, "unknown", ()), command="x")
    assert (tmp_path / "gap.html").read_text().count("<details open>") == 1


@pytest.mark.parametrize(("verdict", "words_there"), [
    ("none", "No unmodelled effect stands out (probability 93%)"),
    ("unknown", "No known effect explains it (probability 93%)")])
def test_pages_of_other_verdicts(pushed_flights, tmp_path, verdict, words_there):
    path = tmp_path / "gap.html"
    gap_report.write_diagnosis(path, of_flights(pushed_flights[:1], (), verdict=verdict), command="x")
    text, _ = checked(path)
    assert words_there in text and "How far it closes" not in text


def test_what_stays_open_is_on_the_page_with_its_seconds_and_the_nearest_effects(tmp_path):
    open_cell = OpenCell("force_y", (0.0, 0.5), "hover", "a/log.csv", from_s=34.0, to_s=42.0, over_floor=6.1,
                         follows=("height",), nearest=(Rejected("wind", "gains 3 nats, but 12 are needed"),))
    result = diagnosis([cell("force_y", "hover", 1.0)], "unknown", (), unexplained=(open_cell,))
    steps = advice.next_steps(replace(result, indistinguishable=()), [], VEHICLE)
    path = tmp_path / "gap.html"
    gap_report.write_diagnosis(path, replace(result, next=steps), command="x")
    text, _ = checked(path)
    assert ("sideways force, 0-0.5 Hz, hover: up to 6.1 times the floor from 34.0 to 42.0 s of log.csv; "
            "follows height") in text
    assert "wind: gains 3 nats, but 12 are needed" in text
    assert 'href="#add-an-effect"' in path.read_text() and "EFFECT = Effect(" in text  # the link leads to a whole file


def test_page_of_a_measurement(pushed_flights, tmp_path):
    path, gap = tmp_path / "gap.html", measure(pushed_flights, VEHICLE)
    gap = replace(gap, curves=curves_of_measurement(gap, pushed_flights, VEHICLE))
    gap_report.write_measurement(path, gap, command="airtouch gap measure x")
    text, page = checked(path)
    assert text.index("Most of the gap lies") < text.index("On the ground") < text.index("The largest cells")
    assert sum(v.startswith("data:") for v in page.loaded) == 3 and "Which effect" not in text and "→" not in text


def test_the_report_computes_nothing():
    """Its modules import no code that fits, replays or calibrates."""
    for name in ("gap_report", "gap_tables", "gap_figures"):
        source = (Path(airtouch.__file__).parent / f"report/{name}.py").read_text()
        lines = re.findall(r"^ *from (airtouch\.(?:gap|simulation)[\w.]*) import (.+)$", source, re.M)
        imports = {f"{module}.{item}." for module, names in lines for item in names.replace(" ", "").split(",")}
        allowed = ("measurement", "result", "where.cell", "where.cell_words", "where.summary", "answer.advice",
                   "answer.curves", "answer.sentences", "answer.words", "signals.channels", "second_process")
        packages = tuple(f"airtouch.gap.{a}." for a in allowed)
        assert imports and all(u.startswith(packages) for u in imports), (name, imports)
        assert not re.search(r"\b(residual|calibrate|ready|closure_of|gap_map)\(", source)


@pytest.mark.parametrize("name", list(EFFECTS))
def test_any_effect_can_be_shown(pushed_flights, name):
    term = term_of(NamedEffect(name, {k: Quantity(v) for k, v in EFFECTS[name].values().items()}))
    assert dict(term.values) == EFFECTS[name].values()
    study, flight = declared_study(VEHICLE, ()), ready(pushed_flights[0], VEHICLE)
    cells_map = gap_map(study, [flight], terms=[term])
    assert all(c.after is not None and c.after >= 0.0 for c in cells_map.cells)
    assert len(summary.cells_to_show(cells_map)) >= 10
    assert gap_tables.maps(cells_map.cells)


def test_the_page_shows_the_docs_own_effect():
    page = (Path(airtouch.__file__).parents[1] / "docs/effects.md").read_text()
    assert gap_report.example_effect() in page


def test_a_ratio_that_stays_is_written_alike_before_and_after():
    stays = gap_tables.heat_map_cell(cell("force_x", "hover", 0.3, after=0.3))
    assert stays["text"] == stays["after"] == "3.0×"
    shrunk = gap_tables.heat_map_cell(cell("force_x", "hover", 2.34, after=0.092))
    assert (shrunk["text"], shrunk["after"]) == ("23×", "0.9×")


def test_the_cell_of_the_answer_has_its_ratio_after_inside_its_floor_too():
    inside = cell("force_y", "hover", 0.05, after=0.02)
    assert gap_tables.heat_map_cell(inside, headline=True)["after"] == "0.2×"
    assert gap_tables.heat_map_cell(inside)["after"] == ""


def test_a_cell_that_stands_out_with_the_effects_alone_has_its_ratio_after_and_is_marked_as_worse(tmp_path):
    """Gaps of 0.1 and 0.3 over floors of 0.1 to 0.12: the first comes out at 0.2, the second, at 0.31, is hardly worse.

    A third is inside its floor before and after.
    """
    cells = [cell("torque_x", "hover", 0.1, after=0.2), cell("force_x", "hover", 0.3, after=0.31),
             cell("force_y", "hover", 0.05, after=0.08)]
    gap_report.write_diagnosis(tmp_path / "gap.html", diagnosis(cells), command="x")
    source = (tmp_path / "gap.html").read_text()
    in_map = source.split('class="map"')[1].split("</table>")[0]
    assert re.findall(r"([\d.]+×)<small>(→ [\d.]+×▲?)<", in_map) == [("3.0×", "→ 3.1×"), ("1.0×", "→ 2.0×▲")]
    assert in_map.count("→") == 2 and "1 worse than before" in source and "▲: worse than before" in source
    gap_report.write_diagnosis(tmp_path / "none.html", diagnosis(cells[1:]), command="x")
    assert "▲" not in (tmp_path / "none.html").read_text()


def test_what_stays_over_the_floor_names_the_cells_that_got_worse_and_the_answers_channel_beside_the_largest(tmp_path):
    """Eleven cells of lift stay at 5 to 6 times the floor; three smaller ones stay too, of which two are named."""
    large = [cell("force_z", "hover", 1.0, after=0.6 - 0.01 * i, band_hz=(float(i), i + 1.0)) for i in range(11)]
    worse, own, other = (cell("torque_x", "cruise", 0.1, after=0.2), cell("force_x", "cruise", 0.4, after=0.3),
                         cell("torque_y", "cruise", 0.4, after=0.3))
    headline = cell("force_x", "hover", 9.0, after=0.05)
    gap_report.write_diagnosis(tmp_path / "gap.html", diagnosis([*large, worse, own, other, headline],
                                                                headline=headline), command="x")
    listed = (tmp_path / "gap.html").read_text().split("What stays over the floor")[1].split("</ul>")[0]
    assert listed.count("<li>") == 12 and "pitch torque" not in listed
    assert listed.count("lift") == 10 and listed.count("forward force") == 1
    assert listed.count("roll torque") == listed.count("worse than before") == 1
    assert "And 2 more cells" in (tmp_path / "gap.html").read_text()


@pytest.mark.parametrize(("judged_on", "seconds", "data"), [
    (HELD_OUT, (), "held out (of a passing effect: on those that it is fitted to)"),
    (FITTED, (("one.csv", 1.0, 2.0),), "held out (of a passing effect: on those that it is fitted to)"),
    (FITTED, (), "that it is fitted to")])
def test_page_and_terminal_say_on_what_data_a_shrink_is_measured(judged_on, seconds, data, tmp_path):
    """Held out; of a passing effect, or without a gyro, of which no half can be held out, on what it was fitted to."""
    result = replace(diagnosis([cell("force_x", "hover", 1.0, after=0.1)],
                               effects=(NamedEffect("downwash", {}, seconds),)), judged_on=judged_on)
    gap_report.write_diagnosis(tmp_path / "gap.html", result, command="x")
    text, _ = checked(tmp_path / "gap.html")
    screen = Console(width=300, file=StringIO())
    show.diagnosis(screen, result)
    for shown in (text, screen.file.getvalue()):
        assert f"goes away on data {data}, with its 90 % interval" in " ".join(shown.split())
