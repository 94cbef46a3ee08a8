"""A wrong name in a user's effect file: told with its line and the nearest right ones, before numba sees it."""

import pytest
from click.testing import CliRunner

from airtouch.errors import AirTouchError
from airtouch.simulation import effects, plant
from airtouch.simulation.effects import names, table

FILE = '''from airtouch.simulation import signals as at
from airtouch.simulation.effects import Effect, Parameter, wrench


@wrench
def push(p, s, memory, generator, out):
    if s[at.TIME] > p[1]:
        out[2] -= p[0] * s[at.HEIGHT]


def slower(plant, values):
    plant["motor_rise"] *= values["lag"]


EFFECT = Effect("late_push", "begins half-way",
                (Parameter("force", "N", 0.01, 0.0, 0.1, 0.0, ""), Parameter("since", "s", 8.0, 0.0, 100.0, None, ""),
                 Parameter("lag", "1", 1.0, 0.5, 3.0, 1.0, "")), settings=slower, wrench=push)
'''
CONSTANTS = "A, B, _, C = range(4)\nKEPT = 50\ni = 99\n"


@pytest.mark.parametrize(("name", "typo", "message"), [
    ("at.HEIGHT", "at.HIGHT", "mine.py:8: no signal 'HIGHT'; did you mean HEIGHT"),
    ("at.TIME", "at.time", "mine.py:7: no signal 'time'; did you mean TIME"),
    ('"motor_rise"', '"motor_rize"', "mine.py:12: no plant field 'motor_rize'; did you mean motor_rise"),
    ('values["lag"]', 'values["laag"]', "mine.py:12: no parameter of this file 'laag'; did you mean lag"),
    ("Effect(\"late", "Efect(\"late", "mine.py:15: NameError"),
    ("def slower(plant, values):", "def slower(plant, values)", "mine.py:11: SyntaxError"),
])
def test_a_wrong_name_has_its_line_and_the_nearest(tmp_path, name, typo, message):
    file = tmp_path / "mine.py"
    file.write_text(FILE.replace(name, typo))
    with pytest.raises(AirTouchError) as error:
        effects.load_file(file)
    assert message in str(error.value) and "\n" not in str(error.value)
    assert "late_push" not in effects.EFFECTS


def test_right_names_pass_and_are_the_tables():
    names.check(FILE, "mine.py")
    page = table.names_table()
    assert all(f"`at.{name}`" in page for name in names.SIGNALS)
    assert all(f"| `{name}` |" in page for name, *_ in plant.FIELDS)
    rows = table.signal_rows()
    assert len(rows) == len(names.SIGNALS) and sum(count for _, count, _ in rows) == 73


def test_a_mistyped_effect_gets_the_nearest():
    with pytest.raises(AirTouchError, match="no effect 'weak_moter'; did you mean weak_motor"):
        effects.get("weak_moter")


@pytest.mark.parametrize(("name", "replacement", "message"), [
    ("wrench=push", "wrnch=push", "mine.py:15: Effect takes no 'wrnch'; did you mean wrench"),
    ("Parameter, wrench\n", "Paramter, wrench\n", "airtouch.simulation.effects has no 'Paramter'; did you mean Param"),
    ("@wrench\n", "", "effect late_push: put @wrench above the function push"),
    ("p[1]:", "p[3]:", "mine.py:7: p[3] does not exist; the last place is p[2]"),
    ("out[2]", "out[6]", "mine.py:8: out[6] does not exist; the last place is out[5]"),
    ("p[0] *", "p[-1] *", "mine.py:8: p[-1] does not exist"),
    ("s[at.HEIGHT]", "s[at.COUNT]", "mine.py:8: no signal 'COUNT'"),
    ("s[at.HEIGHT]", "s[200]", "mine.py:8: s[200] does not exist; the last place is s[72]"),
    ("s[at.HEIGHT]", "s[at.POSITION + 3]", "mine.py:8: s[at.POSITION + 3] does not exist; the last place is s[72]"),
    ("s[at.HEIGHT]", "s[-74]", "mine.py:8: s[-74] does not exist"),
    ("p[0] *", "memory[KEPT] *", "mine.py:8: memory[KEPT] does not exist; the last place is memory[11]"),
    ("p[0] *", "p[C] *", "mine.py:8: p[C] does not exist; the last place is p[2]"),
    ("p[0] *", "p[-13] *", "mine.py:8: p[-13] does not exist"),
    ("p[0] *", "memory[12] *", "mine.py:8: memory[12] does not exist; the last place is memory[11]"),
])
def test_what_compiled_code_would_not_notice_is_refused_with_its_line(name, replacement, message):
    with pytest.raises(AirTouchError) as error:
        effects.load_text(FILE.replace(name, replacement) + CONSTANTS, "mine.py")
    assert message in str(error.value)


@pytest.mark.parametrize("place", ["A", "2", "i"])
def test_places_that_are_there_pass(place):
    text = FILE.replace("    if s[at", "    i = 0\n    if s[at").replace("p[0] *", f"memory[{place} + 9] *")
    names.check(text.replace("s[at.HEIGHT]", "s[at.POSITION + 2]") + CONSTANTS, "mine.py")


@pytest.mark.parametrize("others", [
    'Parameter(name="since", unit="s", default=8.0, low=0.0, high=100.0, neutral=None, source="")',
    '*(Parameter(n, "s", 8.0, 0.0, 100.0, None, "") for n in ("since",))',
    'Parameter("sin" + "ce", "s", 8.0, 0.0, 100.0, None, "")'])
def test_names_by_keyword_and_computed_names_are_names(others):
    text = FILE.replace('Parameter("since", "s", 8.0, 0.0, 100.0, None, "")', others)
    names.check(text.replace("p[1]:", "p[2]:").replace('["lag"]', '["since"]'), "mine.py")


def test_a_name_by_keyword_is_counted():
    text = FILE.replace('Parameter("since", "s", 8.0,', 'Parameter(name="since", unit="s", default=8.0, low=')
    text = text.replace('low= 0.0, 100.0, None, "")', 'low=0.0, high=100.0, neutral=None, source="")')
    with pytest.raises(AirTouchError, match=r"p\[3\] does not exist; the last place is p\[2\]"):
        names.check(text.replace("p[1]:", "p[3]:"), "mine.py")


def test_a_file_that_is_no_text_is_one_line(tmp_path):
    from airtouch.cli.simulate import command

    file = tmp_path / "mine.py"
    file.write_bytes(FILE.replace("half-way", "h\u00e4lftig").encode("latin-1"))
    with pytest.raises(AirTouchError, match="mine.py: no text in UTF-8"):
        effects.load_file(file)
    result = CliRunner().invoke(command, ["paper-low", "--out", str(tmp_path / "out"), "--effect-file", str(file)])
    assert isinstance(result.exception, AirTouchError) and "mine.py: no text in UTF-8" in str(result.exception)
    assert not (tmp_path / "out").exists()
