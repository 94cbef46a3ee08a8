"""`airtouch train` and `airtouch export` from the outside: bad input, exit codes, stale sources."""

import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner
from small_model import random_model

from airtouch.cli import export as export_command
from airtouch.cli import train as train_command
from airtouch.errors import AirTouchError


def airtouch(*arguments: object) -> subprocess.CompletedProcess:
    code = "from airtouch.cli import main; main()"
    return subprocess.run([sys.executable, "-c", code, *map(str, arguments)], capture_output=True, text=True)


def test_a_model_is_exported_and_checked(tmp_path: Path) -> None:
    random_model(sparsity=0.8).save(tmp_path / "mine.npz")
    arguments = [str(tmp_path / "mine.npz"), "--out", str(tmp_path / "model")]
    runner = CliRunner()
    assert runner.invoke(export_command.command, arguments).exit_code == 0
    assert "`airtouch export mine.npz`" in (tmp_path / "model" / "airtouch_model.c").read_text()
    assert "up to date" in runner.invoke(export_command.command, [*arguments, "--check"]).output
    refused = runner.invoke(export_command.command, ["--out", str(tmp_path / "model"), "--check"])
    assert isinstance(refused.exception, AirTouchError) and "stale or foreign" in str(refused.exception)


@pytest.mark.parametrize("command", ["export", "evaluate"])
def test_a_file_that_is_no_model_gives_one_line(tmp_path: Path, command: str) -> None:
    wrong = tmp_path / "wrong.npz"
    wrong.write_bytes(b"PK nothing")
    arguments = [wrong] if command == "export" else [tmp_path, "--model", wrong]
    done = airtouch(command, *arguments)
    assert done.returncode == 2 and done.stdout == ""
    assert done.stderr.count("\n") == 1 and "not a model file" in done.stderr


def test_training_names_what_it_cannot_use(tmp_path: Path) -> None:
    (tmp_path / "empty.csv").write_text("")
    (tmp_path / "words.csv").write_text("no flight at all\n")
    result = CliRunner().invoke(train_command.command, [str(tmp_path), "--out", str(tmp_path / "m.npz")])
    assert isinstance(result.exception, AirTouchError) and "no flight" in str(result.exception)
    assert "empty.csv" in result.output and "words.csv" in result.output
    assert not (tmp_path / "m.npz").exists()


def test_training_refuses_to_overwrite_before_it_starts(tmp_path: Path) -> None:
    (tmp_path / "m.npz").write_bytes(b"kept")
    result = CliRunner().invoke(train_command.command, [str(tmp_path), "--out", str(tmp_path / "m.npz")])
    assert isinstance(result.exception, AirTouchError) and "--force" in str(result.exception)
    assert (tmp_path / "m.npz").read_bytes() == b"kept"
