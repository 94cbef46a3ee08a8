"""Height over a platform: the C that flies beside its reference, through edges of every kind, and what it leaves
alone."""

import ctypes
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from airtouch.reference.floor_height import FloorHeight
from patience import HANG_S

HERE = Path(__file__).parent
CORE = HERE.parents[2] / "firmware/app/core"
SOURCE = CORE / "floor_height.c"
MS = 25
TOP = 0.72


class State(ctypes.Structure):
    _fields_ = [("floor", ctypes.c_float), ("range", ctypes.c_float), ("time", ctypes.c_uint32),
                ("steps", ctypes.c_uint16), ("known", ctypes.c_bool)]


@pytest.fixture(scope="module")
def compiler():
    path = shutil.which("cc") or shutil.which("gcc")
    if path is None:
        pytest.skip("no C compiler on this machine")
    return path


@pytest.fixture(scope="module")
def library(compiler, tmp_path_factory):
    out = tmp_path_factory.mktemp("floor") / "floor.so"
    subprocess.run([compiler, "-std=c11", "-O1", "-Wall", "-Wextra", "-Werror", "-Wdouble-promotion",
                    "-ffp-contract=off", "-shared",
                    "-fPIC", "-fsanitize=undefined", "-fno-sanitize-recover=all", SOURCE, "-lm", "-o", out], check=True)
    floor = ctypes.CDLL(str(out))
    floor.floorHeightRange.restype = floor.floorHeightFlow.restype = ctypes.c_float
    floor.floorHeightRange.argtypes = [ctypes.POINTER(State), ctypes.c_float, ctypes.c_uint32, *[ctypes.c_float] * 3]
    floor.floorHeightFlow.argtypes = [ctypes.POINTER(State), ctypes.c_float]
    return floor


class Crossing:
    """The C and the reference over the same readings; both must say the same."""

    def __init__(self, library):
        self.library, self.state, self.reference = library, State(), FloorHeight()
        self.ms, self.passed = 1000, []

    def read(self, distance, height, climb=0.0, tilt=0.0, ms=MS):
        """One reading of a drone that is, and takes itself to be, at this height."""
        self.ms += ms
        cosine = float(np.float32(np.cos(tilt)))
        values = [float(np.float32(v)) for v in (distance, climb, height)]
        height_m = self.library.floorHeightRange(self.state, values[0], self.ms, cosine, *values[1:])
        expected = self.reference.range(values[0], self.ms, cosine, *values[1:])
        assert height_m == pytest.approx(expected, abs=2e-5, nan_ok=True) and self.state.steps == self.reference.steps
        self.passed.append(height_m)
        return height_m

    def fly(self, tops, heights=0.8, noise=0.0, seed=0, **given):
        """Readings over surfaces of these heights; what the estimator gets less the true height."""
        rng = np.random.default_rng(seed)
        heights = np.broadcast_to(heights, len(tops))
        climbs = np.gradient(heights) / (0.001 * MS)
        return np.array([self.read(h - top + noise * rng.normal(), h, c, **given) - h
                         for top, h, c in zip(tops, heights, climbs, strict=True)])


@pytest.fixture
def drone(library):
    return Crossing(library)


def profile(*parts):
    """Surface heights: (height, readings)..."""
    return np.concatenate([np.full(n, top) for top, n in parts])


@pytest.mark.parametrize("top", [0.1, 0.3, TOP, 0.76])
def test_a_platform_is_crossed_and_left(drone, top):
    off = drone.fly(profile((0.0, 40), (top, 80), (0.0, 80)))
    assert np.abs(off).max() < 0.003
    assert drone.state.floor == 0.0 and drone.state.steps == 2


def test_noise_of_the_range_leaves_a_centimetre_that_fades(library):
    """Twenty flights with 4 mm of noise: what is left at the exit is gone within a second."""
    ends = []
    for seed in range(20):
        drone = Crossing(library)
        off = drone.fly(profile((0.0, 40), (TOP, 80), (0.0, 80)), noise=0.004, seed=seed)
        assert np.abs(off[:120]).max() < 0.03
        assert drone.state.floor == 0.0 and drone.state.steps == 2
        ends.append(off[-10:].mean())
    assert np.abs(ends).max() < 0.006


def test_soft_edges_of_three_readings(drone):
    ramp = [0.24, 0.48]
    off = drone.fly(np.concatenate([profile((0.0, 40)), ramp, profile((TOP, 80)), ramp[::-1], profile((0.0, 60))]))
    assert np.abs(off).max() < 0.003 and drone.state.floor == 0.0


def test_a_climb_is_no_step(drone):
    heights = np.concatenate([np.full(20, 0.3), np.linspace(0.3, 1.5, 48), np.full(40, 1.5)])  # 1 m/s
    off = drone.fly(np.zeros(len(heights)), heights)
    assert np.abs(off).max() < 1e-6 and drone.state.steps == 0


def test_a_climb_over_a_platform_is_told_from_its_edge(drone):
    heights = np.concatenate([np.full(40, 0.8), np.linspace(0.8, 1.2, 40), np.full(60, 1.2)])
    off = drone.fly(profile((0.0, 50), (TOP, 60), (0.0, 30)), heights)
    assert np.abs(off).max() < 0.01 and drone.state.steps == 2


def test_a_slow_ramp_is_followed_as_the_firmware_does(drone):
    """A metre of floor in four seconds."""
    tops = np.linspace(0.0, 0.5, 80)
    off = drone.fly(tops)
    np.testing.assert_allclose(off, -tops, atol=1e-6)
    assert drone.state.steps == 0


@pytest.mark.parametrize("degrees", [5, 15, 25])
def test_edges_under_a_tilt_leave_the_height_as_it_is(drone, degrees):
    tilt = np.deg2rad(degrees)
    tops = profile((0.0, 40), (TOP, 60), (0.0, 60))
    heights = np.array([drone.read((0.8 - top) / np.cos(tilt), 0.8, tilt=tilt) * np.cos(tilt) for top in tops])
    assert np.abs(heights - 0.8).max() < 0.003 and drone.state.floor == 0.0


def test_coming_out_of_a_tilt_is_no_step(drone):
    for degrees in [0, 5, 10, 15, 20, 25, 20, 15, 10, 5, 0] * 3:
        tilt = np.deg2rad(degrees)
        drone.read(0.8 / np.cos(tilt), 0.8, tilt=tilt)
    assert drone.state.steps == 0 and drone.state.floor == 0.0


def test_steeper_than_thirty_degrees_teaches_nothing(drone):
    drone.fly(profile((0.0, 20)))
    assert drone.read(0.08 / np.cos(0.7), 0.8, tilt=0.7) == pytest.approx(0.08 / np.cos(0.7), abs=1e-6)
    assert drone.state.steps == 0


def test_a_single_wrong_reading_passes_by(drone):
    drone.fly(profile((0.0, 20)))
    drone.read(1.9, 0.8)
    off = drone.fly(profile((0.0, 40)))
    assert np.abs(off).max() < 0.003 and drone.state.floor == 0.0


@pytest.mark.parametrize("lost", [3, 20])
def test_a_dropout_over_the_platform_keeps_the_height(drone, lost):
    drone.fly(profile((0.0, 40), (TOP, 40)))
    assert drone.read(0.08, 0.8, ms=MS * lost) == pytest.approx(0.8, abs=0.003)
    off = drone.fly(profile((TOP, 20), (0.0, 60)))
    assert np.abs(off).max() < 0.003


def test_after_a_dropout_with_another_floor_it_is_the_firmware_again(drone):
    drone.fly(profile((0.0, 40), (TOP, 40)))
    assert drone.read(0.8, 0.8, ms=1000) == pytest.approx(0.8)
    assert drone.state.floor == 0.0
    drone.fly(profile((0.0, 20)))
    assert drone.read(0.08, 0.8, ms=1000) == pytest.approx(0.08), "an entry that nobody saw: as without"


def test_from_a_table_to_the_floor(drone):
    off = drone.fly(profile((0.0, 40), (-0.7, 60), (0.0, 60)))
    assert np.abs(off).max() < 0.003 and drone.state.floor == 0.0


@pytest.mark.parametrize("value", [np.nan, np.inf, -1.0])
def test_what_is_no_number_is_passed_on(drone, value):
    drone.fly(profile((0.0, 20)))
    height = drone.read(value, 0.8)
    assert height == value or np.isnan(height)
    assert drone.state.steps == 0
    assert drone.read(0.8, np.nan) == pytest.approx(0.8) and drone.read(0.8, 0.8, climb=np.inf) == pytest.approx(0.8)


def test_a_sum_beyond_belief_ends(drone):
    drone.fly(profile((0.0, 20)))
    for _ in range(4):
        for distance in (0.8, 3.9):
            drone.read(distance, 0.8)
    assert abs(drone.state.floor) <= 2.5


def test_any_readings_leave_finite_numbers(library):
    rng = np.random.default_rng(5)
    drone = Crossing(library)
    for _ in range(3000):
        drone.read(rng.choice([0.0, 0.08, 0.8, 4.0, 1e30, np.nan, rng.uniform(0, 4)]),
                   rng.choice([0.8, 1e30, rng.uniform(-1, 3)]),
                   rng.choice([0.0, -1.0, 1.0, 1e30]), rng.choice([0.0, 0.3, 1.5, 3.0]), int(rng.choice([1, 25, 200])))
        assert np.isfinite(drone.state.floor) and abs(drone.state.floor) <= 2.5


def test_flow_is_scaled_to_the_platform(drone):
    def flow(height):
        return drone.library.floorHeightFlow(drone.state, height)

    assert flow(0.8) == 1.0
    drone.fly(profile((0.0, 40), (0.5, 40)))
    assert flow(0.8) == pytest.approx(0.3 / 0.8, abs=1e-3) == drone.reference.flow(0.8)
    assert flow(0.52) == pytest.approx(0.08 / 0.52, abs=1e-3) and flow(0.0) == 1.0


def test_a_task_that_comes_in_while_another_looks_the_variables_up_uses_none_that_is_not_looked_up(compiler, tmp_path):
    program = tmp_path / "port"
    subprocess.run([compiler, "-std=gnu11", "-O1", "-Wall", "-Wextra", "-Werror", "-Wdouble-promotion",
                    f"-I{HERE / 'crazyflie'}", f"-I{CORE}", HERE / "height_driver.c", SOURCE, "-lm", "-o", program],
                   check=True)
    process = subprocess.run([program], capture_output=True, text=True, timeout=HANG_S)
    assert (process.returncode, process.stdout) == (0, "atHeight.floor atHeight.enable\n"), process.stderr
