"""What `gap_authors.py` asks of the diagnosis, with a stand-in for it."""

import subprocess
import sys

import pytest

from airtouch.errors import AirTouchError
from tools.diagnosis import gap_authors

MANIFEST = """file,use,wind,angle_deg,height
low_0101-a.csv,clean,none,0,low
h80_0103-b.csv,clean,none,0,h80
fan_0103-c.csv,clean,wind,0,low
"""


@pytest.fixture
def asked(tmp_path, monkeypatch):
    """The commands that are run on the manifest, in order; the third ends as `asked.code` says."""
    class Asked(list):
        code = 0

    commands = Asked()

    def run(command):
        commands.append(command[1:])
        return subprocess.CompletedProcess(command, commands.code if len(commands) == 3 else 0)

    (tmp_path / "manifest.csv").write_text(MANIFEST)
    monkeypatch.setattr(subprocess, "run", run)
    monkeypatch.setattr(sys, "argv", ["gap_authors.py", str(tmp_path), str(tmp_path / "out/deep")])
    return commands


def test_each_question_is_one_diagnosis_with_its_flights_baseline_and_files(asked, tmp_path):
    gap_authors.main()
    flights = {name: str(tmp_path / file) for name, file in (("a", "low_0101-a.csv"), ("b", "h80_0103-b.csv"),
                                                             ("c", "fan_0103-c.csv"))}
    for command, name, own, baseline in zip(asked, ("all", "close", "wind"), "aac", ("", "b", "b"), strict=True):
        options = command.index("--vehicle")
        assert command[:options] == ["gap", "diagnose", flights[own]]
        assert command[options:-4] == ["--vehicle", gap_authors.DEFAULT_VEHICLE,
                                       *(["--baseline", flights[baseline]] if baseline else [])]
        out = tmp_path / "out/deep" / name
        assert command[-4:] == ["--json", f"{out}.json", "--report", f"{out}.html"]
    assert (tmp_path / "out/deep").is_dir()


def test_a_diagnosis_that_fails_is_named(asked):
    asked.code = 2
    with pytest.raises(AirTouchError, match="^wind: the diagnosis failed"):
        gap_authors.main()


def test_reports_that_are_there_are_replaced_with_force_alone(asked, tmp_path, monkeypatch):
    (tmp_path / "out/deep").mkdir(parents=True)
    (tmp_path / "out/deep/wind.html").touch()
    with pytest.raises(AirTouchError, match=r"wind.html: exists already; use --force"):
        gap_authors.main()
    assert not asked
    monkeypatch.setattr(sys, "argv", [*sys.argv, "--force"])
    gap_authors.main()
    assert [command[-1] for command in asked] == ["--force"] * 3
