"""`airtouch ablate`, from the outside."""

import json
import shutil
from dataclasses import dataclass

import numpy as np
import pytest
from click.testing import CliRunner

from airtouch import logs
from airtouch.cli.learning.ablate import command
from airtouch.detector import ablation, baseline, best
from airtouch.detector.ablation import ABLATIONS, Ablation
from airtouch.detector.evaluation import crossval
from airtouch.detector.evaluation.data import dataset
from airtouch.detector.trace import Detection, Trace
from airtouch.logs.flight_log import FlightLog
from airtouch.reference.motion_channels import NAMES, MotionConfig, motion_channels
from made_flight import SMALL


def run(*arguments: object):
    return CliRunner().invoke(command, [str(a) for a in arguments])


@pytest.mark.slow
def test_a_size_of_best_and_a_variant_of_the_papers(generated, tmp_path, monkeypatch):
    pytest.importorskip("tensorflow")
    monkeypatch.setattr(best, "Recipe", lambda: SMALL)
    arguments = [generated, "--out", tmp_path / "folds", "--json", tmp_path / "a.json", "--steps", SMALL.steps,
                 "--epochs", 1, "--only", "sparsity-85", "--only", "no-filter"]
    result = run(*arguments)
    assert result.exit_code == 0, result.output
    table = json.loads((tmp_path / "a.json").read_text())
    assert set(table) == {"sparsity-85", "no-filter"}
    assert all(row["flights"] == 4 and len(row["folds"]) == 2 for row in table.values())
    assert "float" in table["sparsity-85"] and "int8" in result.output
    assert table["no-filter"]["folds"][0]["parameters"]["converged_after_epochs"] == 1
    folds = {p.name: p.stat().st_mtime_ns for p in (tmp_path / "folds").glob("*.json")}
    assert run(*arguments, "--force").exit_code == 0
    assert {p.name: p.stat().st_mtime_ns for p in (tmp_path / "folds").glob("*.json")} == folds, "done again"


def test_an_existing_result_is_kept(generated, tmp_path):
    (tmp_path / "a.json").write_text("{}")
    result = run(generated, "--json", tmp_path / "a.json", "--only", "best")
    assert "--force" in str(result.exception)


def test_muted_channels_are_zero_and_the_others_are_not():
    muted = ABLATIONS["f_w-only"].options["muted"]
    scale = tuple(np.inf if i in muted else s for i, s in enumerate(MotionConfig().scale))
    rng = np.random.default_rng(0)
    x, _ = motion_channels(rng.normal(size=(300, 3)), rng.normal(size=(300, 3)),
                           46000 + 900 * rng.normal(size=(300, 4)), MotionConfig(scale=scale))
    alive = {NAMES[i] for i in np.flatnonzero(np.abs(x[150:]).max(axis=0) > 0)}
    assert alive == {"unexplained az"}


@dataclass(frozen=True)
class Fixed:
    """A detector that is not registered: an edge at each of these samples."""

    samples: tuple[int, ...] = ()

    def run(self, log, model=None):
        return Trace(np.full(len(log), np.nan), [Detection(sample, "edge") for sample in self.samples])

    def fit(self, flights, seed=0):
        return baseline.load(None)

    def load(self, path):
        return baseline.load(path)

    def lag_s(self, model):
        return 0.0

    def parameters(self, model):
        return {}


def test_a_variant_and_the_detector_of_the_same_name_share_no_folds(generated, tmp_path, monkeypatch):
    files = dataset.collect([generated])
    detections = []
    for samples in ((), (300, 400)):
        monkeypatch.setitem(ABLATIONS, "baseline", Ablation("paper", "silent", Fixed(samples)))
        detections.append(ablation.ablate(["baseline"], files, tmp_path)["baseline"]["detections"])
    assert detections == [0, 8]
    assert sum(score.detections for score in crossval.crossval("baseline", files, tmp_path).scores) > 8


def test_flights_that_cannot_be_used_are_named_once_and_the_exit_code_says_so(generated, tmp_path, monkeypatch):
    for name in ("best", "no-kick"):
        monkeypatch.setitem(ABLATIONS, name, Ablation("channels", name, Fixed()))
    folder = tmp_path / "flights"
    shutil.copytree(generated, folder)
    arguments = [folder, "--out", tmp_path / "folds", "--only", "best", "--only", "no-kick"]
    whole = run(*arguments)
    assert whole.exit_code == 0, whole.output
    bad = folder / "f0.csv.gz"
    logs.write(FlightLog({"t_s": np.arange(9) / 100.0, "zrange_m": np.ones(9)}, {}), bad, force=True)
    part = run(*arguments)
    assert part.exit_code == 2 and part.stderr.count(f"left out: {bad}") == 1, part.output
