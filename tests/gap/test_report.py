"""The gap report: self-contained, well formed, the answer first, every figure of the diagnosis in it."""

import html.parser
import re

import pytest
import short_flights

from airtouch import vehicle
from airtouch.errors import AirTouchError
from airtouch.gap import calibrate, words
from airtouch.gap.flight import ready
from airtouch.gap.gap_map import gap_map, where
from airtouch.gap.measure import measure
from airtouch.gap.result import Cell, Diagnosis, Found, Quantity, Ranked
from airtouch.report import gap_report, gap_tables
from airtouch.simulation.effects import EFFECTS

VEHICLE = vehicle.load("crazyflie-2.1-flow")
FOUND = Found("imu_bias", {"acc_x": Quantity(0.8, 0.7, 0.9, "m/s^2")})


@pytest.fixture(scope="module")
def flown():
    return [log.with_columns({"acc_x_mps2": log["acc_x_mps2"] + 0.8}) for log in short_flights.fly(2)]


def diagnosis(cells=(), verdict="effect", effects=(FOUND,)):
    ranking = [Ranked("imu_bias", 0.93, Quantity(0.9, 0.8, 0.95)), Ranked("none", 0.04, Quantity(0.0)),
               Ranked("unknown", 0.03, Quantity(0.1, 0.0, 0.2))]
    return Diagnosis(
        verdict, tuple(effects), tuple(ranking), (("mass", "thrust_coefficient"),), tuple(cells),
        {"before": 4.0, "after": 1.3, "floor": 1.0}, Quantity(0.9, 0.8, 0.95),
        {"name": "wind", "before": 4.0, "after": 3.9, "floor": 1.0, "shrink": Quantity(0.03, -0.05, 0.1)},
        "Weigh the <vehicle>.", {"declared": {"before": 4.0, "after": 1.4, "floor": 1.0}}, ("a note",),
        ("no velocity",), ("one.csv", "two.csv"))


class Checker(html.parser.HTMLParser):
    """Collects open tags, text and everything that is loaded."""

    def __init__(self):
        super().__init__()
        self.open, self.loaded, self.text = [], [], []

    def handle_starttag(self, tag, attrs):
        if tag not in ("meta", "img", "br"):
            self.open.append(tag)
        self.loaded += [value for key, value in attrs if key in ("src", "href")]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)


def checked(path):
    source = path.read_text()
    checker = Checker()
    checker.feed(source)
    assert not checker.open and all(v.startswith("data:image/png;base64,") for v in checker.loaded)
    assert "http" not in re.sub(r"base64,[^\"]*", "", source) and "<script" not in source and "viewport" in source
    return " ".join(" ".join(checker.text).split()), checker


def test_page_of_a_diagnosis(flown, tmp_path):
    path = tmp_path / "gap.html"
    gap_report.write_diagnosis(path, diagnosis(), flown, VEHICLE, command="airtouch gap diagnose <x>")
    text, checker = checked(path)
    answer = re.search(r"(\d+%|Nearly all) of the gap .*? is imu bias; adding it shrinks the gap from "
                       r"([\d.]+) to ([\d.]+) m/s\^2, floor ([\d.]+)\.", text)
    assert answer and float(answer[2]) == pytest.approx(0.8, abs=0.15) and float(answer[3]) < 0.3
    assert text.index(answer[0]) < text.index("Where") < text.index("Which effect") < text.index("Before and after")
    for part in ("93.0%", "0.80 to 0.95", "mass and thrust_coefficient", "Weigh the <vehicle>.", "a note", "no velocity",
                 "wrong effect: wind", "vehicle declared", "What stays unexplained", "airtouch gap diagnose <x>"):
        assert part in text, part
    assert len(checker.loaded) == 3
    with pytest.raises(AirTouchError, match="--force"):
        gap_report.write_diagnosis(path, diagnosis(), flown, VEHICLE, command="x")


@pytest.mark.parametrize(("verdict", "effects", "words_there"), [
    ("none", (), "No unmodelled effect stands out"), ("unknown", (), "that no known effect explains"),
    ("unknown", (FOUND,), "besides imu bias that no known effect explains")])
def test_pages_of_other_verdicts(flown, tmp_path, verdict, effects, words_there):
    path = tmp_path / "gap.html"
    gap_report.write_diagnosis(path, diagnosis(verdict=verdict, effects=effects), flown[:1], VEHICLE, command="x")
    text, _ = checked(path)
    assert words_there in text


def test_page_of_a_measurement(flown, tmp_path):
    path, found = tmp_path / "gap.html", measure(flown, VEHICLE)
    gap_report.write_measurement(path, found, flown, VEHICLE, command="airtouch gap measure x")
    text, checker = checked(path)
    assert text.index("The gap is largest") < text.index("On the ground") < text.index("The largest cells")
    assert len(checker.loaded) == 3 and "Which effect" not in text and "→" not in text


@pytest.mark.parametrize("name", list(EFFECTS))
def test_any_effect_can_be_shown(flown, name):
    term = gap_report.term_of(Found(name, {k: Quantity(v) for k, v in EFFECTS[name].values().items()}))
    assert dict(term.values) == EFFECTS[name].values()
    study, flight = calibrate.declared(VEHICLE, ()), ready(flown[0], VEHICLE)
    made = gap_map(study, [flight], terms=[term])
    assert all(c.after is not None and c.after >= 0.0 for c in made.cells) and len(where(made)) >= 10
    assert gap_tables.maps(made)


def test_sentence_takes_its_figures_from_the_cell_that_tells_most():
    cells = [Cell("torque_x", (0.0, 0.5), "hover", 16.0, 0.9, "rad/s^2", 14.0, 18.0, after=15.5),
             Cell("force_z", (0.0, 0.5), "over platform", 0.43, 0.04, "m/s^2", 0.4, 0.5, after=0.06)]
    said = words.answer(diagnosis(cells, effects=(Found("ground_effect", {}),)))
    assert said == ("95% of the gap over the platform in lift (0-0.5 Hz) is ground effect; adding it shrinks the gap "
                    "from 0.43 to 0.06 m/s^2, floor 0.04.")
