"""Model files: refused in one line before their size or content can do harm."""

import io
import zipfile
from dataclasses import dataclass

import numpy as np
import pytest

from airtouch.detector.shared import archive
from airtouch.errors import AirTouchError

ARRAYS = {"b": np.arange(6, dtype=np.float32).reshape(2, 3), "a": np.array([1, -2], np.int8)}


@dataclass
class Layer:
    """What `check_range` reads of a layer."""

    weights: np.ndarray
    bias: np.ndarray
    weight_scale: np.ndarray
    input_scale: float = 1.0
    output_scale: float = 1.0
    weighted: bool = True


def test_bytes_are_those_of_the_content_whatever_its_order():
    data = archive.to_bytes(ARRAYS, {"seed": 3, "name": "x"})
    assert data == archive.to_bytes(dict(sorted(ARRAYS.items())), {"name": "x", "seed": 3})
    arrays, metadata = archive.parse(data, "model.npz")
    assert metadata == {"name": "x", "seed": 3} and set(arrays) == set(ARRAYS)
    for name, values in ARRAYS.items():
        np.testing.assert_array_equal(arrays[name], values)
        assert arrays[name].dtype == values.dtype


def test_a_small_file_that_unpacks_to_more_than_fits_is_refused_unread():
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("a.npy", bytes(archive.LARGEST + 1))
    assert len(content.getvalue()) < archive.LARGEST // 100
    with pytest.raises(AirTouchError, match="bomb.npz: not a model file"):
        archive.parse(content.getvalue(), "bomb.npz")


def test_a_file_larger_than_any_model_is_not_read(tmp_path):
    path = tmp_path / "large.npz"
    with open(path, "wb") as file:
        file.truncate(archive.LARGEST + 1)
    with pytest.raises(AirTouchError, match="too large for a model file"):
        archive.read(path)
    with pytest.raises(AirTouchError, match="cannot be read: No such file.*; the shipped models are in .*models$"):
        archive.read(tmp_path / "absent.npz")


@pytest.mark.parametrize("part", [0, 1, 30, 100, -1])
def test_a_file_that_was_cut_off_is_refused(part):
    with pytest.raises(AirTouchError, match="not a model file"):
        archive.parse(archive.to_bytes(ARRAYS, {})[:part], "cut.npz")


def test_another_kind_of_model_is_named():
    archive.check_kind({"kind": "best", "window": 200}, {"kind": "best"}, "m.npz")
    with pytest.raises(AirTouchError, match="model kind 'paper', this detector needs 'best'"):
        archive.check_kind({"kind": "paper"}, {"kind": "best"}, "m.npz")


@pytest.mark.parametrize(("weight", "bias", "scale", "fits"), [
    (0, 2**31 - 1, 0.5, True),  # pruned: a constant, whose bias may fill int32
    (0, 1, 1.5, False),
    (1, 2**28 - 256 - 1, 1.0, True), (1, 2**28 - 256, 1.0, False), (-1, -(2**28 - 256), 1.0, False),
    (1, 2**27 - 256 - 1, 2.0, True), (1, 2**27 - 256, 2.0, False),  # a scale above one counts as well
])
def test_no_input_may_drive_an_accumulator_beyond_the_kernels_rounding(weight, bias, scale, fits):
    """One weight: the accumulator is at most |bias| + 256 |weight|, as inputs less their zero point reach 255."""
    layer = Layer(np.array([[weight]], np.int8), np.array([bias], np.int32), np.array([scale], np.float32))
    if fits:
        archive.check_range([layer], "m.npz")
    else:
        with pytest.raises(AirTouchError, match="int8 biases or scales out of range"):
            archive.check_range([layer], "m.npz")
