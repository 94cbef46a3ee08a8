"""Signals of the recorded flights, as float32, which is what the kernels are fed."""

import csv
from dataclasses import dataclass

import numpy as np
import pytest

from airtouch.detector.shared.channels import level_acceleration, nine_channels, thrust_axis
from airtouch.logs import read
from airtouch.logs.flight_log import GYRO, PWM


@dataclass(frozen=True)
class Signals:
    """One flight."""

    name: str
    channels: np.ndarray  #: (n, 9)
    acc: np.ndarray
    gyro: np.ndarray
    pwm: np.ndarray
    thrust_axis: np.ndarray | None


@pytest.fixture(scope="session")
def real_signals(flights):
    """Every clean flight of the manifest."""
    folder = flights / "airtouch"
    with open(folder / "manifest.csv", newline="") as file:
        names = [row["file"] for row in csv.DictReader(file) if row["use"] == "clean"]
    return [_signals(folder / name) for name in names]


def _signals(path):
    log = read(path)
    axis = thrust_axis(log)
    acc, gyro, pwm = (np.float32(a) for a in (level_acceleration(log), log.stack(GYRO), log.stack(PWM)))
    return Signals(path.name, nine_channels(log), acc, gyro, pwm, None if axis is None else np.float32(axis))
