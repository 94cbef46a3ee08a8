"""`airtouch train` and `airtouch export` from the outside: bad input, exit codes, stale sources."""

import io
import re
import sys
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from click.testing import CliRunner

from airtouch import kernels, logs, reference
from airtouch import vehicle as vehicles
from airtouch.cli import main
from airtouch.cli.learning import export as export_command
from airtouch.cli.learning import train as train_command
from airtouch.detector import best, registry
from airtouch.detector.evaluation.data import simulated
from airtouch.detector.shared import training_set, vehicle_header
from airtouch.errors import AirTouchError
from airtouch.reference.motion_channels import MotionConfig
from made_flight import SMALL, made_flight
from small_model import random_model

#: level acceleration, rates and motors of four seconds at a mean PWM of 14,000
FLIGHT = (np.tile([0.0, 0.0, 9.81], (400, 1)), np.zeros((400, 3)),
          np.tile(14000.0 + 500.0 * np.sin(np.arange(400) / 9)[:, None], (1, 4)))


class Told(NamedTuple):
    """What the program left: its exit code and what it wrote."""

    returncode: int | str
    stdout: str
    stderr: str


@pytest.fixture
def airtouch(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., Told]:
    """airtouch(...): the program's own entry, in this process; a process of its own would import for a second."""
    def run(*arguments: object) -> Told:
        monkeypatch.setattr(sys, "argv", ["airtouch", *map(str, arguments)])
        capsys.readouterr()
        with pytest.raises(SystemExit) as ending:
            main()
        return Told(ending.value.code or 0, *capsys.readouterr())

    return run


def test_a_model_is_exported_and_checked(tmp_path: Path) -> None:
    random_model(sparsity=0.8).save(tmp_path / "mine.npz")
    arguments = [str(tmp_path / "mine.npz"), "--out", str(tmp_path / "model")]
    runner = CliRunner()
    assert runner.invoke(export_command.command, arguments).exit_code == 0
    assert "`airtouch export mine.npz`" in (tmp_path / "model" / "airtouch_model.c").read_text()
    assert "up to date" in runner.invoke(export_command.command, [*arguments, "--check"]).output
    result = runner.invoke(export_command.command, ["--out", str(tmp_path / "model"), "--check"])
    assert isinstance(result.exception, AirTouchError) and "stale or foreign" in str(result.exception)


def test_check_refuses_sources_that_no_shipped_model_gives(tmp_path: Path, airtouch: Callable[..., Told]) -> None:
    folder = tmp_path / "model"
    assert airtouch("export", "--out", folder).returncode == 0
    check = airtouch("export", "--check", "--out", folder)
    assert check.returncode == 0 and check.stdout.count("up to date") == 3
    (folder / "airtouch_old.c").write_text("int old;\n")
    foreign = airtouch("export", "--check", "--out", folder)
    assert foreign.returncode == 2 and "airtouch_old.c: foreign" in foreign.stderr
    (folder / "airtouch_old.c").unlink()
    source = folder / "airtouch_rolling.c"
    source.write_text(source.read_text().replace("{", "{ ", 1))
    after_edit = airtouch("export", "--check", "--out", folder)
    assert after_edit.returncode == 2 and "edited since" in after_edit.stderr and after_edit.stderr.count("\n") == 1


@pytest.mark.parametrize("command", ["export", "evaluate"])
def test_a_file_that_is_no_model_gives_one_line(tmp_path: Path, airtouch: Callable[..., Told], command: str) -> None:
    path = tmp_path / "wrong.npz"
    path.write_bytes(b"PK nothing")
    arguments = [path] if command == "export" else [tmp_path, "--model", path]
    result = airtouch(command, *arguments)
    assert result.returncode == 2 and result.stdout == ""
    assert result.stderr.count("\n") == 1 and "not a model file" in result.stderr


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


def train(*arguments: object):
    return CliRunner().invoke(train_command.command, [str(a) for a in arguments])


@pytest.mark.parametrize("options", [
    ("--detector", "paper", "--steps", 3), ("--detector", "paper-stream", "--steps", 3), ("--epochs", 3),
    ("--lambda", 0)])
def test_an_option_of_another_detector_is_refused_before_flights_are_read(tmp_path: Path, options: tuple) -> None:
    result = train(tmp_path / "absent", "--out", tmp_path / "m.npz", *options)
    assert result.exit_code == 2 and f"{options[-2]}" in result.output and "--detector" in result.output
    assert "no such file" not in result.output


@pytest.mark.slow
@pytest.mark.parametrize(("detector", "short"), [("best", ("--steps", SMALL.steps)), ("paper", ("--epochs", 1))])
def test_training_on_simulated_flights_says_what_they_were(tmp_path: Path, monkeypatch, detector: str,
                                                           short: tuple) -> None:
    pytest.importorskip("tensorflow", reason="training needs the extra 'train'")
    monkeypatch.setattr(best, "Recipe", lambda: SMALL)
    out = tmp_path / "m.npz"
    result = train("--simulated", 4, "--scenario", "paper-low", "--without", "gust", "--detector", detector, *short,
                   "--seed", 3, "--out", out)
    assert result.exit_code == 0, result.output
    metadata = registry.get(detector).load(out).metadata
    provenance = metadata["simulated"]
    expected = {"scenario": "paper-low", "flights": 4, "seed": 3, "without": ["gust"]}
    assert {key: provenance[key] for key in expected} == expected
    assert "ground_effect" in provenance["effects"] and "gust" not in provenance["effects"]
    assert len(metadata["flights"]) == 4 and all(name.startswith("paper-low_3_") for name in metadata["flights"])
    assert "simulated: paper-low, seed 3" in result.output


def test_simulated_flights_are_the_same_for_the_same_seed() -> None:
    counts = []
    first, provenance = simulated.training_flights(2, "paper-low", seed=5, progress=lambda *a: counts.append(a))
    repeat, _ = simulated.training_flights(2, "paper-low", seed=5)
    other, _ = simulated.training_flights(2, "paper-low", seed=5, without=("ground_effect",))
    assert all((a["gyro_x_radps"] == b["gyro_x_radps"]).all() for a, b in zip(first, repeat, strict=True))
    assert first[0].meta["condition"] == other[0].meta["condition"]
    assert not any(name == "ground_effect" for log in other for name, _ in log.meta["effects"])
    assert [a[1:3] for a in counts] == [(1, 2), (2, 2)] and provenance["effects"]


@pytest.mark.parametrize(("arguments", "message"), [
    (("--simulated", 2, "--scenario", "nowhere"), "nowhere"),
    (("--simulated", 2, "--without", "magic"), "magic"),
    (("--simulated", 2, "--without", "vibration"), "off in paper-mixed already"),
    (("--simulated", 2, "--scenario", "hover"), "crossed an edge"),
    (("--simulated", 2, "--detector", "baseline"), "nothing to train"),
    (("--simulated", 2, "."), "not both"),
    (("--scenario", "paper-low"), "need --simulated"),
    (("--without", "gust", "."), "need --simulated"),
])
def test_simulated_training_refuses_in_one_line(tmp_path: Path, arguments: tuple, message: str) -> None:
    result = train(*arguments, "--out", tmp_path / "m.npz")
    assert result.exit_code != 0 and not (tmp_path / "m.npz").exists()
    assert message in (str(result.exception) + result.output)


def test_best_is_trained_and_exported_for_the_thrust_curve_of_another_vehicle(tmp_path: Path) -> None:
    """The curve, the gravity and the PWM in the air are those of the vehicle's file, on the desktop and in C."""
    pytest.importorskip("tensorflow", reason="training needs the extra 'train'")
    (tmp_path / "mine").mkdir()
    logs.write(made_flight(0), tmp_path / "mine" / "f.csv")
    (tmp_path / "own.toml").write_text((Path(vehicles.__file__).parent / "vehicles/crazyflie-2.1-brushless.toml")
                                       .read_text().replace("crazyflie-2.1-brushless", "own"))
    best.fit([made_flight(8)], recipe=SMALL).save(tmp_path / "old.npz")
    start = ("--start", tmp_path / "old.npz", "--steps", SMALL.steps)
    result = train(tmp_path / "mine", *start, "--vehicle", tmp_path / "own.toml", "--out", tmp_path / "new.npz")
    assert result.exit_code == 0, result.output
    model, own = best.load(tmp_path / "new.npz"), vehicles.load(tmp_path / "own.toml")
    assert model.recipe.motion.vehicle == own and model.recipe.motion.arm_pwm == own.arm_pwm == 11700
    (built_for,) = re.findall('AIRTOUCH_STREAM_THRUST "(.*)"', "".join(model.c_sources().values()))
    assert built_for in vehicle_header.render(own)
    assert built_for not in vehicle_header.render(vehicles.load())
    x, airborne = kernels.motion_channels(*FLIGHT, model.recipe.motion)
    np.testing.assert_allclose(x, reference.motion_channels(*FLIGHT, MotionConfig(vehicle=own, arm_pwm=11700))[0],
                               atol=1e-3)
    assert airborne.all() and np.abs(x - kernels.motion_channels(*FLIGHT)[0]).max() > 0.01
    assert train(tmp_path / "mine", "--detector", "paper", "--vehicle", "own.toml").exit_code == 2
    damaged = replace(model, recipe=replace(model.recipe, vehicle=replace(own, mass_kg=-1.0)))
    damaged.save(tmp_path / "bad.npz")
    with pytest.raises(AirTouchError, match="mass_kg"):
        best.load(tmp_path / "bad.npz")


@pytest.mark.parametrize("name", ["best", "best_without_acceleration"])
def test_the_files_of_models_for_the_default_vehicle_are_as_they_were(name: str) -> None:
    """Every array in every byte; the headers of the archive around them are those of this Python's zipfile."""
    path = Path(vehicles.__file__).parent / "models" / f"{name}.npz"
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(io.BytesIO(best.load(path).to_bytes())) as new:
        assert new.namelist() == old.namelist()
        assert all(new.read(member) == old.read(member) for member in old.namelist())


def test_best_goes_on_from_a_model_with_some_flights_and_free_air(tmp_path: Path) -> None:
    for folder, count in (("mine", 3), ("calm", 1)):
        (tmp_path / folder).mkdir()
        for i in range(count):
            log = made_flight(i)
            if folder == "calm":
                log.columns["zrange_m"][:] = 0.8
            logs.write(log, tmp_path / folder / f"f{i}.csv")
    best.fit([made_flight(8)], recipe=SMALL).save(tmp_path / "old.npz")
    result = train(tmp_path / "mine", "--start", tmp_path / "old.npz", "--labelled", 2, "--free-air", tmp_path / "calm",
                   "--steps", SMALL.steps, "--out", tmp_path / "new.npz")
    assert result.exit_code == 0, result.output
    assert "trained on 2 flights" in result.output
    metadata = best.load(tmp_path / "new.npz").metadata
    assert len(metadata["flights"]) == 3 and metadata["free_air"] == 1
    assert training_set.contains(metadata, logs.read(tmp_path / "calm" / "f0.csv")), "free air is training data too"
    assert not training_set.contains(metadata, made_flight(9))
    refusal = train(tmp_path / "mine", "--detector", "paper", "--labelled", 2, "--out", tmp_path / "m.npz")
    assert refusal.exit_code == 2 and "for --detector best" in refusal.output
