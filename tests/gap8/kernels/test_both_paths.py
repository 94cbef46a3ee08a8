"""The portable path and the XPULP path give NumPy's bits, windowed and rolling."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from airtouch import kernels, logs
from airtouch.detector.evaluation.data.dataset import collect
from airtouch.detector.paper import model as model_file
from airtouch.detector.paper.features import flight_features
from airtouch.detector.paper.normalisation import FixedScale
from airtouch.errors import AirTouchError
from airtouch.kernels import network as c_network
from airtouch.kernels import rolling
from airtouch.reference.networks import int8_network
from gap8.kernels.made_networks import network as made
from small_model import random_model

POOLS = st.sampled_from([None, (2, 1), (1, 2), (2, 2), (3, 1)])
STAGES = st.lists(st.tuples(st.integers(1, 4), st.integers(1, 2), st.sampled_from([1, 2, 3, 4, 5, 8, 12]), POOLS),
                  min_size=1, max_size=3)
FITS = settings(max_examples=60, deadline=None)


def fits(rows: int, columns: int, channels: int, stages: list[tuple]) -> bool:
    for kernel_rows, kernel_columns, outputs, pooling in stages:
        rows, columns = rows - kernel_rows + 1, columns - kernel_columns + 1
        if kernel_rows * kernel_columns * channels > 64:
            return False
        if pooling:
            rows, columns = rows // pooling[0], columns // pooling[1]
        channels = outputs
        if rows < 1 or columns < 1:
            return False
    return True


def samples(shape: tuple[int, ...], seed: int) -> np.ndarray:
    return np.random.default_rng(seed).integers(-128, 128, shape).astype(np.int8)


@pytest.mark.usefixtures("path")
class TestBothPaths:
    """Each test runs over the portable path and over the XPULP path."""

    @settings(FITS, suppress_health_check=list(HealthCheck))
    @given(seed=st.integers(0, 2**31), rows=st.integers(4, 20), columns=st.integers(1, 4),
           channels=st.sampled_from([1, 2, 3, 4, 8]), stages=STAGES,
           dense=st.lists(st.integers(1, 9), min_size=1, max_size=2), sparsity=st.sampled_from([0.0, 0.6, 0.95, 1.0]))
    def test_any_network_has_the_bits_of_numpy(self, seed, rows, columns, channels, stages, dense, sparsity):
        assume(fits(rows, columns, channels, stages))
        net = made(seed, rows, columns, channels, stages, dense, sparsity)
        x = samples((7, rows * columns * channels), seed)
        np.testing.assert_array_equal(c_network.run_int8(net, x), int8_network.run(net, x))

    @pytest.mark.parametrize("sparsity", [0.0, 0.8])
    def test_extreme_inputs_give_the_bits_of_numpy(self, sparsity):
        net = random_model(seed=5, sparsity=sparsity).int8
        x = np.array([[-128] * 300, [127] * 300, [-128, 127] * 150, [0] * 300], dtype=np.int8)
        np.testing.assert_array_equal(c_network.run_int8(net, x), int8_network.run(net, x))

    def test_real_windows_of_the_shipped_network(self, flights: Path):
        model = model_file.load()
        fused = flight_features(logs.read(collect([flights / "airtouch"])[0].path)).fused
        ends = [i for i in range(99, len(fused), 3) if np.isfinite(fused[i - 99:i + 1]).all()]
        windows = kernels.z_score_window(np.stack([fused[i - 99:i + 1] for i in ends]))
        assert len(windows) > 200
        np.testing.assert_array_equal(c_network.infer_int8(model, windows),
                                      int8_network.infer_int8(model.int8, windows))

    @settings(FITS, suppress_health_check=list(HealthCheck))
    @given(seed=st.integers(0, 2**31), columns=st.integers(1, 3), channels=st.sampled_from([1, 4]),
           first=st.sampled_from([None, (2, 1), (3, 1), (2, 2)]), second=st.sampled_from([None, (2, 1), (1, 2)]),
           rows=st.integers(22, 33), sparsity=st.sampled_from([0.0, 0.8]), fully=st.booleans())
    def test_rolling_is_every_window(self, seed, columns, channels, first, second, rows, sparsity, fully):
        stages = [(3, 1, 4, first), (2, 1, 5, second)]
        assume(fits(rows, columns, channels, stages))
        net = made(seed, rows, columns, channels, stages, [4, 2], sparsity)
        stride = (first or (1, 1))[0] * (second or (1, 1))[0] if fully else 1
        self.check_rolling(net, samples((rows + 30, columns * channels), seed), stride)

    @pytest.mark.parametrize("stride", [1, 2, 4])
    @pytest.mark.parametrize("sparsity", [0.0, 0.9])
    def test_the_papers_network_rolls(self, stride, sparsity):
        self.check_rolling(random_model(seed=7, sparsity=sparsity).int8, samples((260, 3), 1), stride)

    def check_rolling(self, net, x, stride):
        rows = net.input_shape[0]
        size = rolling.rolling_size(net, stride)
        out, valid = rolling.run_rolling(net, x, stride)
        assert (np.diff(np.flatnonzero(valid)) == stride).all()
        assert rows - 1 - size.ahead <= np.flatnonzero(valid)[0] < rows - 1 - size.ahead + stride
        ends = np.flatnonzero(valid) + size.ahead
        chosen = ends[ends < len(x)]
        windows = np.stack([x[end - rows + 1:end + 1] for end in chosen])
        np.testing.assert_array_equal(out[chosen - size.ahead], int8_network.run(net, windows))

    def test_a_reset_forgets_the_samples_before(self):
        net = random_model(seed=7, sparsity=0.9).int8
        x, usable = samples((400, 3), 2), np.ones(400, bool)
        usable[[5, 150, 151]] = False
        out, valid = rolling.run_rolling(net, x, 4, usable)
        outputs, answered = rolling.run_rolling(net, x[152:], 4)
        assert not valid[:6 + 97].any() and not valid[150:152 + 97].any() and valid[103:150].any()
        np.testing.assert_array_equal(valid[152:], answered)
        np.testing.assert_array_equal(out[152:], outputs)


def test_networks_that_cannot_roll_are_refused() -> None:
    paper = random_model().int8
    for stride in (0, 3, 8):
        with pytest.raises(AirTouchError, match="cannot roll"):
            rolling.rolling_size(paper, stride)
    with pytest.raises(AirTouchError, match="cannot roll"):
        rolling.rolling_size(made(0, 8, 1, 4, [(2, 1, 4, None)], [], 0.0))
    with pytest.raises(AirTouchError, match="needs samples"):
        rolling.run_rolling(paper, np.zeros((10, 4), np.int8))


def test_usable_is_one_flag_a_sample() -> None:
    paper = random_model().int8
    x = np.zeros((600, paper.input_shape[1] * paper.input_shape[2]), np.int8)
    with pytest.raises(AirTouchError, match=r"usable must be \(600,\)"):
        rolling.run_rolling(paper, x, 4, np.ones(10, bool))


@given(st.lists(st.floats(0, 2.0**126, width=32), min_size=3, max_size=60))
def test_the_fixed_scale_is_a_logarithm(values: list[float]) -> None:
    features = np.array(values[:len(values) // 3 * 3], np.float32).reshape(-1, 3)
    scale = FixedScale(np.array([10, -5, 3], np.float32), np.array([40, 2, 0.5], np.float32))
    scaled = rolling.fixed_scale(scale.mean, scale.deviation, features)
    np.testing.assert_allclose(scaled, scale.apply(features), rtol=0, atol=3e-5)


def test_the_fixed_scale_takes_what_is_no_number_for_the_smallest() -> None:
    scale = FixedScale(np.zeros(3, np.float32), np.full(3, 20, np.float32))
    scaled = rolling.fixed_scale(scale.mean, scale.deviation, np.array([[np.nan, -1.0, np.inf]], np.float32))
    np.testing.assert_allclose(scaled, [[-2.0, -2.0, 4.0]])


def test_inputs_are_held_between_answers_and_unknown_after_a_gap() -> None:
    from dataclasses import replace

    scale = FixedScale(np.full(3, 20, np.float32), np.full(3, 2, np.float32))
    model = replace(random_model(seed=3, sparsity=0.9), scale=scale)
    features = np.random.default_rng(0).gamma(1.0, 1e6, size=(500, 3)).astype(np.float32)
    features[:40] = np.nan
    features[300, 2] = np.inf
    each, fourth = (rolling.probability_of_samples(model, features, stride) for stride in (1, 4))
    assert np.isnan(each[:137]).all() and np.isfinite(each[137:300]).all() and np.isnan(each[300:398]).all()
    answers = np.flatnonzero(np.isfinite(fourth))[0] + 4 * np.arange(30)
    np.testing.assert_array_equal(fourth[answers], each[answers])
    np.testing.assert_array_equal(fourth[answers + 3], fourth[answers])
