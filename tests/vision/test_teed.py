"""The network's sizes against TEED's publication, its NumPy against Keras."""

from importlib import resources

import numpy as np
import pytest

from airtouch.errors import AirTouchError
from airtouch.vision import teed
from airtouch.vision import weights as shipped
from skips import needs


def test_three_colours_give_the_published_number_of_parameters():
    """58K parameters (Soria et al. 2023).

    Added up by hand: 448 + 2320 + 4640 + 9248 + 13872 + 20784 + 544 + 1584 + 22 + 38 + 4930 + 480.
    """
    assert teed.parameters(colours=3) == 58910
    assert teed.parameters() == 58910 - 2 * 9 * 16


def test_multiplications_of_one_layer_at_a_time():
    """The first layer: 9 x 16 of one colour, at half the rows and columns."""
    difference = teed.multiplications(320, 320, colours=3) - teed.multiplications(320, 320, colours=1)
    assert difference == 2 * 9 * 16 * 160 * 160


def test_smish_is_its_definition():
    x = np.linspace(-20.0, 20.0, 401)
    assert teed.smish(x) == pytest.approx(x * np.tanh(np.log1p(1.0 / (1.0 + np.exp(-x)))), abs=1e-12)


@needs("keras")
@needs("tensorflow")
def test_the_network_in_numpy_has_keras_outputs():
    model = teed.build_keras((4, 8, 12))
    assert model.count_params() == teed.parameters((4, 8, 12))
    rng = np.random.default_rng(3)
    for layer in model.layers:  # biases too, which start at 0
        layer.set_weights([rng.normal(scale=0.3, size=w.shape) for w in layer.get_weights()])
    image = rng.integers(0, 255, (24, 40)).astype(np.uint8)
    logit = np.asarray(model(teed.normalise(image)[None, ..., None]))[0, ..., 0]
    assert np.ptp(logit) > 0.1
    assert teed.infer(teed.weights_of_keras(model), image) == pytest.approx(1.0 / (1.0 + np.exp(-logit)), abs=1e-5)


@pytest.mark.parametrize("name", shipped.SIZES)
def test_weights_that_come_with_the_package_fit_their_network(name):
    weights, seconds = shipped.load(name)
    shapes = teed.layers(shipped.SIZES[name])
    assert {f"{n}.{part}" for n in shapes for part in ("kernel", "bias")} == set(weights) and seconds > 0.0
    for layer, shape in shapes.items():
        assert weights[f"{layer}.kernel"].shape == shape and weights[f"{layer}.bias"].shape == (teed.outputs(layer,
                                                                                                             shape),)


@pytest.mark.parametrize("kept", [0, 100, 5000])
def test_weights_cut_short_are_one_line(tmp_path, monkeypatch, kept):
    whole = resources.files("airtouch.vision") / "eighth.npz"
    (tmp_path / "eighth.npz").write_bytes(whole.read_bytes()[:kept])
    monkeypatch.setattr(shipped.resources, "files", lambda _: tmp_path)
    with pytest.raises(AirTouchError, match="eighth.npz: .*; make it with"):
        shipped.load("eighth")
