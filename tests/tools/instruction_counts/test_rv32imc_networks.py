"""The networks as the GAP8 runs them, in an emulator: the desktop's and tflite-micro's bits, and a budget."""

import tomllib
from functools import cache
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("unicorn", reason="pip install unicorn")
pytest.importorskip("ziglang", reason="pip install ziglang")

from airtouch import kernels, logs
from airtouch.detector import best
from airtouch.detector.best.batches import channels_of
from airtouch.detector.best.export import golden_flight
from airtouch.detector.evaluation.data.dataset import collect
from airtouch.detector.paper import model as model_file
from airtouch.detector.paper import rolling
from airtouch.detector.paper.export import golden_vectors
from airtouch.detector.paper.features import flight_features
from airtouch.kernels.network import arena_bytes, parameter_bytes, run_int8
from airtouch.kernels.rolling import fixed_scale, rolling_size, run_rolling
from airtouch.kernels.stream import arena_bytes as stream_arena_bytes
from airtouch.kernels.stream import run_stream
from airtouch.reference.networks.int8_network import quantise
from tools.instruction_counts import gap8
from tools.instruction_counts.build import ROOT

BUDGET = tomllib.loads((ROOT / "tools/instruction_counts/gap8_budget.toml").read_text())
CORES = (1, 2, 4, 8)


@pytest.fixture(scope="module")
def models():
    return {"paper": model_file.load(), "paper-stream": rolling.load(None), "best": best.load(None)}


@pytest.fixture(scope="module")
def chips(models):
    """The shipped models, compiled for plain rv32imc."""
    return {name: gap8.compile_model(model) for name, model in models.items()}


@pytest.fixture(scope="module")
def clusters(models):
    """Those that run over windows, compiled for XPULP."""
    return {name: gap8.compile_model(models[name], gap8.XPULP) for name in ("paper", "paper-stream")}


@pytest.fixture(scope="module")
def team_run(models, clusters):
    """(model, cores) -> a window of their own for each number of cores, the cycles, and every core's output."""
    @cache
    def run(name: str, cores: int):
        window = golden_vectors(models[name].int8)[0][cores]
        return window, *gap8.team_cycles(clusters[name], window, cores)

    return run


@pytest.fixture(scope="module")
def fused(flights: Path) -> list[np.ndarray]:
    """Fused features (n, 3) of a few recorded flights."""
    per_flight = [flight_features(logs.read(file.path)).fused for file in collect([flights / "airtouch"])[::30]]
    return [features[np.isfinite(features).all(axis=1)] for features in per_flight]


def quantised_windows(model, fused: list[np.ndarray]) -> np.ndarray:
    raw = np.concatenate([np.stack([f[i - 99:i + 1] for i in range(99, len(f), 40)]) for f in fused])
    windows = (fixed_scale(model.scale.mean, model.scale.deviation, raw.reshape(-1, 3)).reshape(raw.shape)
               if model.scale else kernels.z_score_window(raw))
    first = model.int8.layers[0]
    return quantise(windows, first.input_scale, first.input_zero_point).reshape(len(windows), -1)


def tflite_micro(content: bytes, quantised: np.ndarray) -> np.ndarray:
    runtime = pytest.importorskip("tflite_micro", reason="pip install tflite-micro").runtime
    interpreter = runtime.Interpreter.from_bytes(content)
    out = []
    for window in quantised.reshape(-1, 1, 100, 3, 1):
        interpreter.set_input(window, 0)
        interpreter.invoke()
        out.append(interpreter.get_output(0)[0].copy())
    return np.array(out)


@pytest.mark.parametrize("name", ["paper", "paper-stream"])
def test_real_windows_have_the_desktops_and_tflite_micros_bits(name, models, chips, fused):
    model, quantised = models[name], quantised_windows(models[name], fused)
    assert len(quantised) > 100
    outputs = gap8.windows(chips[name], quantised).outputs
    np.testing.assert_array_equal(outputs, run_int8(model.int8, quantised))
    np.testing.assert_array_equal(outputs, tflite_micro(model.tflite, quantised))
    assert len(np.unique(outputs, axis=0)) > 20


@pytest.mark.parametrize("stride", [1, 4])
def test_a_real_flight_as_a_stream_has_the_bits_of_its_windows(stride, models, chips, fused):
    model = models["paper-stream"]
    first = model.int8.layers[0]
    inputs = fixed_scale(model.scale.mean, model.scale.deviation, fused[0][:700])
    quantised = quantise(inputs, first.input_scale, first.input_zero_point)
    expected, valid = run_rolling(model.int8, quantised, stride)
    outputs = gap8.rolling(chips["paper-stream"], quantised, stride).outputs
    np.testing.assert_array_equal(outputs, expected[valid])
    ends = np.flatnonzero(valid) + rolling_size(model.int8, stride).ahead
    ends = ends[ends < len(quantised)]
    windows = np.stack([quantised[end - 99:end + 1] for end in ends])
    np.testing.assert_array_equal(outputs[:len(ends)], tflite_micro(model.tflite, windows))


def test_best_as_a_stream_has_the_desktops_bits(models, chips, flights):
    model = models["best"]
    log = logs.read(collect([flights / "airtouch"])[0].path)
    channels, _ = channels_of(log, model.recipe.motion)
    first = model.int8.layers[0]
    quantised = quantise(channels[200:800], first.input_scale, first.input_zero_point)
    np.testing.assert_array_equal(gap8.stream(chips["best"], quantised).outputs,
                                  run_stream(model.int8, quantised))


@pytest.mark.parametrize("name", ["paper", "paper-stream"])
@pytest.mark.parametrize("cores", CORES)
def test_xpulp_cores_have_the_desktops_bits(name, cores, models, team_run):
    window, cycles, outputs = team_run(name, cores)
    np.testing.assert_array_equal(outputs, np.repeat(run_int8(models[name].int8, window[None]), cores, axis=0))
    if f"cycles_{cores}" in BUDGET[name]:
        assert cycles.looped <= BUDGET[name][f"cycles_{cores}"]


def test_eight_cores_are_at_least_six_times_as_fast_as_one(team_run):
    single, team = (team_run("paper", cores)[1].looped for cores in (1, 8))
    assert single / team > 6


@pytest.mark.parametrize("name", ["paper", "paper-stream"])
def test_windows_stay_in_the_budget(name, models, chips):
    counts = gap8.windows(chips[name], golden_vectors(models[name].int8)[0])
    assert counts.instructions.max() <= BUDGET[name]["window_instructions"]
    assert counts.stack <= BUDGET[name]["stack_bytes"]


def test_streams_stay_in_the_budget(models, chips):
    rolled = gap8.rolling(chips["paper-stream"], golden_vectors(models["paper"].int8)[0][0].reshape(-1, 3)[:100],
                                 4)
    streamed = gap8.stream(chips["best"], golden_flight(models["best"].int8)[0][:100])
    for name, counts in (("paper-stream", rolled), ("best", streamed)):
        assert counts.instructions.mean() <= BUDGET[name]["step_instructions"]
        assert counts.instructions.max() <= BUDGET[name]["step_instructions_worst"]
        assert counts.stack <= BUDGET[name]["stack_bytes"]


def test_bytes_stay_in_the_budget(models, chips):
    arenas = {"paper": arena_bytes(models["paper"].int8), "best": stream_arena_bytes(models["best"].int8),
              "paper-stream": rolling_size(models["paper-stream"].int8, 4).arena_bytes}
    for name, chip in chips.items():
        sizes = {"parameter_bytes": parameter_bytes(models[name].int8), "constant_bytes": chip.constant_bytes,
                 "flash_bytes": chip.flash_bytes, "arena_bytes": arenas[name]}
        assert {kind: size for kind, size in sizes.items() if size > BUDGET[name][kind]} == {}
