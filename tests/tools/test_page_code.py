"""The Python of the pages fits the package's types, and their TOML is accepted by the program that reads it."""

import inspect
import re
import tomllib
from pathlib import Path

import pytest

from airtouch import api
from airtouch.logs.formats import mapped
from airtouch.simulation import scenario
from airtouch.vehicle import check_firmware

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "host/docs"
PAGES = sorted([*ROOT.glob("*.md"), *DOCS.glob("*.md")])


def blocks(page: Path, language: str) -> list[str]:
    """The fenced blocks of a page in a language."""
    return re.findall(rf"^```{language}\n(.*?)^```", page.read_text("utf-8"), re.S | re.M)


def complaints(sources: dict[str, str], folder: Path) -> str:
    """What mypy says of the sources. Names that a block takes as given (a list of flights) have any type."""
    mypy = pytest.importorskip("mypy.api", reason="could not import mypy: pip install 'airtouch[test]'")
    for name, source in sources.items():
        (folder / f"{name}.py").write_text(source, "utf-8")
    messages, errors, _ = mypy.run([
        *(str(folder / f"{name}.py") for name in sources), "--disable-error-code=name-defined",
        f"--config-file={ROOT / 'pyproject.toml'}", f"--cache-dir={ROOT / 'build/mypy-pages'}"])
    assert not errors
    return messages


def test_the_python_of_the_pages_fits_the_types(tmp_path, monkeypatch):
    monkeypatch.chdir(ROOT)  # where mypy_path begins
    sources = {f"{page.stem.replace('-', '_')}_{number}": block
               for page in PAGES for number, block in enumerate(blocks(page, "python"))}
    assert len(sources) > 7
    messages = complaints(sources, tmp_path)
    assert messages.startswith("Success"), messages


def test_python_that_does_not_fit_is_told(tmp_path, monkeypatch):
    monkeypatch.chdir(ROOT)
    wrong = ("import airtouch as at", "found = at.gap.diagnose(given)", "found.verdikt", "at.adopt('a', 'b')",
             "at.evaluate('flights', detektor='best')", "from airtouch import logz")
    messages = complaints({"wrong": "\n".join(wrong)}, tmp_path)
    assert all(word in messages for word in ("verdikt", "adopt", "detektor", "logz")), messages
    assert "Found 4 errors" in messages, messages


def test_the_type_checker_knows_what_each_function_returns(tmp_path, monkeypatch):
    monkeypatch.chdir(ROOT)
    calls = {'at.read("f.csv")': "FlightLog", 'at.detect("f.csv")': "Trace", 'at.evaluate("f.csv")': "dict[",
             'at.simulate("hover")': "list[", 'at.adapt("flights", "m.npz")': "Adapted",
             'at.gap.diagnose("f.csv")': "Diagnosis", 'at.gap.measure("f.csv")': "Measurement"}
    source = "\n".join(["import airtouch as at", *(f"reveal_type({call})" for call in calls)])
    lines = complaints({"revealed": source}, tmp_path).splitlines()
    for line, returned in zip(lines, calls.values(), strict=False):
        assert "Revealed type" in line and returned in line, lines


@pytest.mark.parametrize("page", ["gap-floor", "gap-relations", "twin-method", "kernels"])
def test_the_python_of_a_page_prints_what_stands_below_it(page, capsys):
    """Blocks that need no files, in their order, with the names of those before them."""
    shown = re.findall(r"^```python\n(.*?)^```\n+```\n(.*?)^```", (DOCS / f"{page}.md").read_text("utf-8"), re.S | re.M)
    assert shown
    names: dict[str, object] = {}
    for source, output in shown:
        exec(source, names)
        assert capsys.readouterr().out == output


def test_the_toml_of_the_pages_is_accepted(tmp_path):
    scene, firmware = blocks(DOCS / "simulate.md", "toml")
    drawn = scenario.parse(scene, "simulate.md")
    assert drawn.name == "my-sweep" and scenario.draw_flight(drawn, 0, 0)
    named = tomllib.loads(firmware)
    check_firmware(named["firmware"], named["range_module"], "simulate.md")
    (columns,) = blocks(DOCS / "logs.md", "toml")
    (tmp_path / "map.toml").write_text(columns, "utf-8")
    assert set(mapped.load(tmp_path / "map.toml")["columns"]) == {"t_s", "gyro_x_radps"}
    assert sum(len(blocks(page, "toml")) for page in PAGES) == 3


def test_the_table_of_functions_has_their_arguments_and_defaults():
    rows = re.findall(r"`at\.([\w.]+)\(([^`]*)\)`", "".join(
        line for line in (DOCS / "python.md").read_text("utf-8").splitlines(True) if line.startswith("| `at.")))
    of_gap = {"diagnose", "measure", "plots"}
    assert {name for name, _ in rows} == {*api.__all__} - of_gap | {f"gap.{name}" for name in of_gap}
    for name, listed in rows:
        function = getattr(api, name.removeprefix("gap."))
        parameters = [argument if parameter.default is inspect.Parameter.empty else f"{argument}={parameter.default!r}"
                 for argument, parameter in inspect.signature(function).parameters.items()]
        assert listed.replace('"', "'") == ", ".join(parameters), name
