"""Simulated flights, written once."""

import numpy as np
import pytest

import short_flights
from airtouch import logs

HEADER = "file,use,fold,height,angle_deg,wind,speed_mps\n"


@pytest.fixture(scope="session")
def generated(tmp_path_factory):
    """A folder with four simulated flights in two folds and their manifest."""
    folder = tmp_path_factory.mktemp("flights")
    rows = []
    for i, log in enumerate(short_flights.fly(4)):
        condition = log.meta["condition"]
        logs.write(log, folder / f"f{i}.csv.gz")
        rows.append(f"f{i}.csv.gz,clean,{i % 2},low,{condition['angle']:g},none,{condition['speed']:.3f}\n")
    (folder / "manifest.csv").write_text(HEADER + "".join(rows))
    return folder


@pytest.fixture
def bad(generated, tmp_path):
    """name -> a file that no detector can score."""
    log = logs.read(generated / "f0.csv.gz")
    nan = {name: np.where(np.arange(len(log)) % 3 == 0, v, np.nan) for name, v in log.columns.items()}
    constant = {name: np.full(len(log), v[600]) for name, v in log.columns.items()}
    stuck = {**log.columns, "gyro_y_radps": np.full(len(log), 0.25)}
    copied = {**log.columns, **{f"gyro_{a}_radps": log[f"acc_world_{a}_mps2"] for a in "xyz"}}
    grounded = {**log.columns, **{f"m{i}_pwm": np.zeros(len(log)) for i in range(1, 5)}}
    for name, columns in (("nan", nan), ("constant", constant), ("stuck", stuck), ("copied", copied),
                          ("grounded", grounded)):
        logs.write(log.with_columns(columns), tmp_path / f"{name}.csv")
    logs.write(log.slice(0, 150), tmp_path / "short.csv")
    (tmp_path / "empty.csv").write_text("")
    (tmp_path / "six.csv").write_text("0.1,0.2,0.3,0.9,12345,0.01\n" * 500)
    (tmp_path / "header.csv").write_text("a,b,c\n1,2,3\n")
    (tmp_path / "cut.csv.gz").write_bytes((generated / "f0.csv.gz").read_bytes()[:200])
    slow = log.slice(0, len(log))
    slow.columns["t_s"] = np.arange(len(log)) * 0.002
    slow.meta["sample_period_s"] = 0.002
    logs.write(slow, tmp_path / "fast.csv")
    return {path.name.split(".")[0]: path for path in tmp_path.iterdir()}
