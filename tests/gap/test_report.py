"""The gap report: self-contained, well formed, the answer first, every figure of the diagnosis in it and none of its
own."""

import html.parser
import re
from dataclasses import replace
from pathlib import Path

import pytest

import airtouch
import short_flights
from airtouch import vehicle
from airtouch.cli.gap import show as gap_show
from airtouch.cli.shared import scores
from airtouch.errors import AirTouchError
from airtouch.gap.answer import advice, words
from airtouch.gap.answer.pictures import of, of_measurement
from airtouch.gap.answer.ranking import agreeing
from airtouch.gap.flights.flight import ready
from airtouch.gap.measure import measure
from airtouch.gap.nominal import calibrate
from airtouch.gap.result import BASELINE, Cell, Diagnosis, Found, GapMap, Quantity, Ranked, Step
from airtouch.gap.signatures.candidates import term_of
from airtouch.gap.where import summary
from airtouch.gap.where.gap_map import gap_map, where
from airtouch.report import gap_report, gap_tables
from airtouch.simulation import effects as registry
from airtouch.simulation.effects import EFFECTS

VEHICLE = vehicle.load("crazyflie-2.1-flow")
FOUND = Found("imu_bias", {"acc_x": Quantity(0.8, 0.7, 0.9, "m/s^2")})


@pytest.fixture(scope="module")
def flown():
    return [log.with_columns({"acc_x_mps2": log["acc_x_mps2"] + 0.8}) for log in short_flights.fly(2)]


def cell(channel, phase, gap, floor=0.1, after=None, blocks=10, **more):
    return Cell(channel, more.pop("band_hz", (0.0, 0.5)), phase, gap, floor, "m/s^2", 0.9 * gap, 1.1 * gap,
                blocks=blocks, flights=1, after=after, floor_high=1.2 * floor, **more)


def diagnosis(cells=(), verdict="effect", effects=(FOUND,), headline=None, **more):
    rest = [Ranked(n, p, Quantity(0.0), "another fits better")
            for n, p in (("mass", 0.04), ("none", 0.02), ("unknown", 0.01))]
    answer = effects[0].name if effects else verdict
    ranking = [Ranked(answer, 0.93, Quantity(0.9, 0.8, 0.95)), *(r for r in rest if r.name != answer)]
    made = GapMap(tuple(cells), BASELINE, ("one.csv", "two.csv"))
    return Diagnosis(
        verdict, tuple(effects), tuple(ranking), (("mass", "thrust_coefficient"),), tuple(cells),
        {"before": 4.0, "after": 1.3, "floor": 1.0}, Quantity(0.9, 0.8, 0.95) if effects else None,
        {"name": "wind", "before": 4.0, "after": 3.9, "floor": 1.0, "shrink": Quantity(0.03, -0.05, 0.1)},
        "Weigh the <vehicle>.", {"declared": {"before": 4.0, "after": 1.4, "floor": 1.0}}, ("a note",),
        ("no velocity",), ("one.csv", "two.csv"),
        map=made, headline=headline or summary.headline(cells, bool(effects)),
        next=(Step("Weigh the <vehicle>.", "airtouch collect --mission hover"),), vehicle=VEHICLE.name, **more)


def of_flights(flown, effects=(FOUND,), **more):
    """A diagnosis with map and curves of flights."""
    study, flights = calibrate.declared(VEHICLE, ()), [ready(f, VEHICLE) for f in flown]
    terms = [term_of(e) for e in effects]
    made = gap_map(study, flights, terms=terms)
    found = diagnosis(made.cells, effects=effects, **more)
    return replace(found, where=tuple(where(made)), pictures=of(study, flights, [], terms, found.headline, made.cells))


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
    inside = {v for v in checker.loaded if v.startswith("#")}
    assert not checker.open and all(v.startswith("data:image/png;base64,") for v in set(checker.loaded) - inside)
    assert all(f'id="{v[1:]}"' in source for v in inside), inside
    assert "http" not in re.sub(r"base64,[^\"]*", "", source) and "<script" not in source and "viewport" in source
    return " ".join(" ".join(checker.text).split()), checker


def test_page_of_a_diagnosis(flown, tmp_path):
    path, found = tmp_path / "gap.html", of_flights(flown)
    gap_report.write_diagnosis(path, found, command="airtouch gap diagnose <x>")
    text, checker = checked(path)
    said = words.sentences(found)
    assert found.headline.channel == "force_x" and "forward force at 0-0.5 Hz" in said[0]
    assert "imu bias (probability 93%)" in said[1] and "takes away 90% (80% to 95%)" in said[2]
    assert [text.index(s) for s in said] == sorted(text.index(s) for s in said)
    order = [text.index(s) for s in (said[2], "What to do next", "The largest cells", "still be the wrong one")]
    assert order == sorted(order)
    for part in ("93.0%", "0.80 to 0.95", "mass and thrust_coefficient", "Weigh the <vehicle>.", "a note",
                 "no velocity",
                 "wrong effect: wind", "imu_bias, vehicle as declared", "airtouch gap diagnose <x>",
                 "another fits better", "airtouch collect --mission hover"):
        assert part in text, part
    assert sum(v.startswith("data:") for v in checker.loaded) == 3
    with pytest.raises(AirTouchError, match="--force"):
        gap_report.write_diagnosis(path, found, command="x")


def test_no_text_stands_twice_and_the_headlines_cell_is_marked_once(flown, tmp_path):
    path, found = tmp_path / "gap.html", of_flights(flown)
    gap_report.write_diagnosis(path, found, command="x")
    source = path.read_text()
    for s in (*words.sentences(found), found.advice):
        assert source.count(s.replace("<", "&lt;").replace(">", "&gt;")) == 1, s
    assert source.count('<td class="headline"') == 1 and source.count('<tr class="headline"') == 1
    title = re.search(r'<td class="headline"[^>]*title="([^"]*)"', source).group(1)
    assert title.startswith(gap_tables.in_words(found.headline))


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
def test_pages_of_other_verdicts(flown, tmp_path, verdict, words_there):
    path = tmp_path / "gap.html"
    gap_report.write_diagnosis(path, of_flights(flown[:1], (), verdict=verdict), command="x")
    text, _ = checked(path)
    assert words_there in text and "How far it closes" not in text


def test_what_stays_open_is_on_the_page_with_its_seconds_and_the_nearest_effects(tmp_path):
    entry = {"channel": "force_y", "band_hz": [0.0, 0.5], "phase": "hover", "flight": "a/log.csv", "from_s": 34.0,
             "to_s": 42.0,
             "over_floor": 6.1, "follows": ["height"],
             "nearest": [{"name": "wind", "fails": "gains 3 nats, 12 are needed"}]}
    found = diagnosis([cell("force_y", "hover", 1.0)], "unknown", (), unexplained=(entry,))
    steps = advice.steps("unknown", [], [], found.headline, [], True, VEHICLE.name)
    path = tmp_path / "gap.html"
    gap_report.write_diagnosis(path, replace(found, next=steps), command="x")
    text, _ = checked(path)
    assert ("sideways force, 0-0.5 Hz, hover: up to 6.1 times the floor from 34.0 to 42.0 s of log.csv; "
            "follows height") in text
    assert "wind: gains 3 nats, 12 are needed" in text
    assert 'href="#add-an-effect"' in path.read_text() and "EFFECT = Effect(" in text  # the link leads to a whole file


def test_page_of_a_measurement(flown, tmp_path):
    path, found = tmp_path / "gap.html", measure(flown, VEHICLE)
    gap_report.write_measurement(path, found, of_measurement(found, flown, VEHICLE), command="airtouch gap measure x")
    text, checker = checked(path)
    assert text.index("Most of the gap lies") < text.index("On the ground") < text.index("The largest cells")
    assert sum(v.startswith("data:") for v in checker.loaded) == 3 and "Which effect" not in text and "→" not in text


def test_the_report_computes_nothing():
    """Its modules import no code that fits, replays or calibrates."""
    for name in ("gap_report", "gap_tables", "gap_figures"):
        source = (Path(airtouch.__file__).parent / f"report/{name}.py").read_text()
        lines = re.findall(r"^ *from (airtouch\.(?:gap|simulation)[\w.]*) import (.+)$", source, re.M)
        used = {f"{module}.{what}." for module, names in lines for what in names.replace(" ", "").split(",")}
        allowed = ("measure", "result", "where.gap_map", "where.summary", "answer.advice", "answer.pictures",
                   "answer.words", "signals.channels")
        assert used and all(u.startswith(tuple(f"airtouch.gap.{a}." for a in allowed)) for u in used), (name, used)
        assert not re.search(r"\b(residual|calibrate|ready|shrink_of|gap_map)\(", source)


@pytest.mark.parametrize("name", list(EFFECTS))
def test_any_effect_can_be_shown(flown, name):
    term = term_of(Found(name, {k: Quantity(v) for k, v in EFFECTS[name].values().items()}))
    assert dict(term.values) == EFFECTS[name].values()
    study, flight = calibrate.declared(VEHICLE, ()), ready(flown[0], VEHICLE)
    made = gap_map(study, [flight], terms=[term])
    assert all(c.after is not None and c.after >= 0.0 for c in made.cells) and len(where(made)) >= 10
    assert gap_tables.maps(made.cells)


def test_headline_is_what_most_of_the_gap_is_not_the_largest_ratio():
    """A take-off cell of 26 floors in one block against a sideways force of 10 floors in four phases."""
    cells = [cell("force_z", "take-off", 2.6, blocks=1),
             *(cell("force_y", p, 1.0, blocks=10) for p in ("hover", "cruise", "over platform", "landing"))]
    one = summary.headline(cells)
    assert (one.channel, one.phase) == ("force_y", "hover")
    said = words.sentences(diagnosis(cells, "unknown", ()))
    assert said[0] == ("The gap lies mostly in sideways force at 0-0.5 Hz: in hover it is 1 m/s^2, 10 times the floor, "
                       "and it "
                       "stands out in 4 of 5 phases in the air.")
    texts = [s.text for s in advice.steps("unknown", [], [], one, [], True, "v")]
    assert "more of hover" in texts[0] and not any("take-off" in t for t in texts)


def test_a_cell_of_the_ground_or_of_one_regime_is_no_headline():
    cells = [cell("force_z", "ground", 9.0), cell("force_z", "hover", 8.0, regime="height < 0.1 m"),
             cell("force_x", "hover", 0.5)]
    assert summary.headline(cells).channel == "force_x"
    assert summary.headline(cells[:2]) is None


def test_headline_of_named_effects_is_where_they_take_most():
    cells = [cell("torque_x", "hover", 16.0, 0.9, after=15.9), cell("force_z", "over platform", 0.43, 0.04, after=0.04)]
    found = diagnosis(cells, effects=(Found("ground_effect", {}),))
    assert found.headline is cells[1] and "lift" in words.sentences(found)[0]
    assert ("1 of 2 cells still stand out, the largest in hover in roll torque at 0-0.5 Hz "
            "(18 to 18 times the floor)") in words.answer(found)


def test_an_effect_that_leaves_the_largest_cell_is_not_called_its_cause():
    cells = [cell("torque_z", "hover", 2.0, 0.004, after=1.9)]
    said = words.sentences(diagnosis(cells, effects=(Found("motor_noise", {}),)))
    assert said[1] == "The effect named, motor noise (probability 93%), does not close this cell."
    assert "500 to 475 times the floor" in said[2].replace("  ", " ")


def test_rotors_are_told_apart():
    weak = [Found("weak_motor", {"rotor": Quantity(i)}) for i in (1, 2)]
    said = words.sentences(diagnosis([cell("torque_x", "hover", 1.0, after=0.1)], effects=weak))[1]
    assert said == "Its cause is weak motor of rotor 1 (probability 93%), with weak motor of rotor 2 beside it."


def test_what_got_worse_is_said():
    cells = [cell("force_z", "hover", 1.0, after=0.05), cell("force_x", "ground", 1.5, after=2.2),
             cell("force_y", "ground", 2.6, after=8.8)]
    said = words.sentences(diagnosis(cells))[2]
    assert "2 of 3 cells still stand out, the largest on the ground in sideways force" in said
    assert "(26 to 88 times the floor)" in said
    assert said.endswith("and 2 got worse.")
    ground = next(p for p in summary.phases(cells) if p.name == "ground")
    assert (ground.over, ground.stay, ground.worse) == (2, 2, 2)


def test_headline_and_ranking_cannot_disagree():
    first, beside = Found("motor_noise", {}), Found("weak_motor", {})
    said = words.sentences(diagnosis([cell("force_z", "hover", 1.0, after=0.1, by="weak_motor")],
                                     effects=(first, beside)))
    assert said[1] == "Its cause is motor noise (probability 93%), with weak motor beside it."
    good = diagnosis()
    for wrong in ({"effects": (beside, first)}, {"verdict": "none"}, {"verdict": "unknown"}, {"effects": ()},
                  {"ranking": good.ranking[::-1]}):
        with pytest.raises(ValueError, match="ranking begins with"):
            replace(good, **wrong)


def test_probabilities_agree_with_the_verdict():
    chance = {"wind": 0.2, "mass": 0.5, "none": 0.2, "unknown": 0.1}
    made = agreeing(chance, "unknown")
    assert made == {"wind": 0.2, "mass": 0.1, "none": 0.2, "unknown": 0.5} and agreeing(chance, "mass") == chance
    # one that was found in stretches of time alone
    assert agreeing({"none": 1.0}, "gust") == {"none": 0.0, "gust": 1.0}


def test_closing_figures_are_one(flown, tmp_path):
    """Sentence, JSON and page have one share and one before and after;
    the calibrated arm, which is the same, is not told again."""
    found = of_flights(flown)
    same = {"before": 4.0, "after": 1.3, "shrink": found.shrink.plain()}
    found = replace(found, arms={"declared": {"before": 5.0, "after": 2.0, "shrink": Quantity(0.7).plain()},
                                 "calibrated": same})
    plain = found.plain()
    assert plain["shrink"] == plain["ranking"][0]["shrink"] and plain["gap"]["before"] == 4.0
    assert "from 4 to 1.3 times the floor" in words.sentences(found)[2]
    rows = gap_tables.how_far(found)["rows"]
    assert [r["name"] for r in rows] == ["imu_bias", "wrong effect: wind", "imu_bias, vehicle as declared"]


def test_json_has_headline_map_and_steps(flown):
    plain = of_flights(flown).plain()
    assert plain["headline"] in plain["map"] and len(plain["map"]) > len(plain["where"])
    assert plain["next"] == [{"text": "Weigh the <vehicle>.", "command": "airtouch collect --mission hover"}]


def test_terminal_says_what_the_page_says(flown, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "400")
    found = of_flights(flown)
    gap_show.diagnosis(scores.console(), found)
    out = " ".join(capsys.readouterr().out.split())
    for part in (*words.sentences(found), "another fits better", "Weigh the <vehicle>.",
                 "airtouch collect --mission hover"):
        assert part in out, part


def test_advised_commands_can_be_given():
    """Every effect's command is taken by `simulate` as it stands, and every mission advised can be loaded."""
    from airtouch.crazyflie import mission

    for name, effect in EFFECTS.items():
        values = {p.name: Quantity(p.default * 1.23456789 if p.low <= p.default * 1.23456789 <= p.high
                                   and not p.integer else p.default, unit=p.unit) for p in effect.parameters}
        line = advice.switched_on([Found(name, values)], VEHICLE.name)
        given = registry.parse(line.split("--effect ")[1].strip("'"))
        assert given[0] == name and given[1] == pytest.approx({k: q.value for k, q in values.items()}, rel=1e-3)
    for name in (*advice.MISSIONS.values(), *(m for _, m in advice.SEPARATES.values() if m)):
        assert mission.load(name).legs


def test_the_page_shows_the_docs_own_effect():
    page = (Path(airtouch.__file__).parents[1] / "docs/effects.md").read_text()
    assert gap_report.example_effect() in page
