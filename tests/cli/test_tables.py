"""What commands print fits the terminal: nothing is cut off, and a command can be copied."""

import io
import re
import subprocess
import sys
import time

import pytest
from rich.console import Console

import airtouch.gap.diagnosis as diagnose
from airtouch.cli.gap import show
from airtouch.cli.gap.progress import LateBar
from airtouch.cli.shared import output
from airtouch.gap import example
from airtouch.logs import read
from airtouch.report.columns import COLUMNS
from airtouch.vehicle import load
from gap_flights import LOOP, without_fits


def summary(missed):
    figures = {key.split("/")[0]: 0.5 for key, _ in COLUMNS.values()}
    hits = {"0.05": 0.25, "0.10": 0.5, "0.25": 1.0}
    interval = {"0.05": (0.1, 0.4), "0.10": (0.3, 0.7), "0.25": (0.9, 1.0)}
    return {**figures, "flights": 87, "edges": 174, "hit": hits, "missed": missed,
            "intervals": {**dict.fromkeys(figures, (0.25, 0.75)), "hit": interval}}


def printed(width, show_on):
    screen = Console(file=io.StringIO(), width=width)
    show_on(screen)
    return screen.file.getvalue()


@pytest.mark.parametrize("width", [80, 100, 149, 150, 200])
@pytest.mark.parametrize("count", [1, 3, 7])
def test_every_figure_of_every_summary_is_printed(width, count):
    rows = {f"case {n}": summary(n / 100) for n in range(count)}
    text = printed(width, lambda screen: output.print_table(screen, rows, "a title"))
    assert "\u2026" not in text and max(map(len, text.splitlines())) <= width
    assert all(f"case {n}" in text and f"{n}%" in text for n in range(count))
    assert text.count("90% - 100%") == count and text.count("a title") == text.count("95 % interval") == 1


def test_the_caption_explains_columns_that_are_there():
    explained = re.findall(r"(?:^|\. )([^.:]+(?:\.\d+ m)?): ", output.INTERVALS + output.CAPTION)
    assert explained[0] == "second line" and len(explained) == 4
    assert set(explained[1:]) <= set(COLUMNS)


@pytest.mark.parametrize("width", [80, 170])
def test_the_caption_speaks_of_a_second_line_only_where_there_is_one(width):
    """As of one flight, from which no interval is known."""
    one, several = summary(0.5), summary(0.25)
    one["intervals"] = {**dict.fromkeys(one["intervals"]), "hit": dict.fromkeys(one["hit"])}
    for rows, has in (({"one": one}, False), ({"one": one, "several": several}, True)):
        text = printed(width, lambda screen, rows=rows: output.print_table(screen, rows, "a title"))
        assert ("second line" in text) is has and "missed: no detection" in text


@pytest.fixture(scope="module")
def diagnosis():
    """Of all effects but the loop's; how the nominal flights scatter is no matter of the tables' width."""
    nominal = [read(path) for path in example.nominal()]
    with pytest.MonkeyPatch.context() as patch:
        without_fits(patch)
        return diagnose.diagnose([read(example.real())], load(str(nominal[0].meta["vehicle"])), nominal, without=LOOP)


@pytest.mark.parametrize("width", [80, 100, 170])
def test_a_diagnosis_fits_the_width_of_the_terminal(diagnosis, width):
    text = printed(width, lambda screen: show.diagnosis(screen, diagnosis))
    command, = (step.command for step in diagnosis.next if step.command)
    assert "\u2026" not in text and command in text
    assert max(len(line) for line in text.splitlines() if command not in line) <= width
    head, = (line for line in text.splitlines() if "phase" in line and "gap/floor" in line)
    assert "after" in head and "regime" not in head  # all cells are of one regime


def test_the_bar_of_a_long_command_needs_nothing_slow():
    code = ("import sys, airtouch.cli.gap.progress\n"
            "print(sorted({'scipy', 'numba', 'airtouch.gap'} & set(sys.modules)))")
    process = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert process.stdout.strip() == "[]", process.stderr


def test_a_long_command_without_a_terminal_says_by_lines_where_it_is(monkeypatch, capsys):
    monkeypatch.setattr(LateBar, "LINE_S", 0.05)
    with LateBar(3, "diagnosing") as bar:
        bar("flight_1.csv")
        time.sleep(0.3)
    lines = capsys.readouterr().err.splitlines()
    assert lines and all(re.fullmatch(r"\[ +\d+ s\] flight_1\.csv, step 1 of 3", line) for line in lines)
