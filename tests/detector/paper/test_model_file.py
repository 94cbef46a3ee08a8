"""Model files: what was saved comes back, anything else is one clear line."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from airtouch.detector.paper import model as model_file
from airtouch.errors import AirTouchError
from small_model import random_model


@pytest.fixture(scope="module")
def model() -> model_file.Model:
    return random_model(sparsity=0.8)


def test_a_model_comes_back_as_it_was(model: model_file.Model, tmp_path: Path) -> None:
    model.save(tmp_path / "m.npz")
    reloaded = model_file.load(tmp_path / "m.npz")
    assert reloaded.digest == model.digest and reloaded.metadata == model.metadata and reloaded.tflite == model.tflite
    assert all((reloaded.weights[name] == values).all() for name, values in model.weights.items())
    assert reloaded.to_bytes() == model.to_bytes()
    with pytest.raises(AirTouchError, match="--force"):
        model.save(tmp_path / "m.npz")


def test_the_shipped_model_is_small_and_complete() -> None:
    shipped = model_file.load()
    assert len(shipped.to_bytes()) < 200_000
    assert shipped.metadata["command"].startswith("airtouch train")
    assert len(shipped.metadata["flights"]) == 87


def test_the_shipped_models_tflite_file_holds_the_same_network() -> None:
    from airtouch.detector.paper.quantisation import read_tflite

    shipped = model_file.load()
    assert replace(shipped, int8=read_tflite(shipped.tflite)).digest == shipped.digest


@settings(max_examples=150, deadline=None)
@given(st.binary(max_size=400), st.booleans())
def test_any_bytes_give_one_line(data: bytes, zipped: bool) -> None:
    with pytest.raises(AirTouchError) as error:
        model_file.parse(b"PK\x03\x04" + data if zipped else data, "x.npz")
    assert "\n" not in str(error.value) and str(error.value).startswith("x.npz")


def test_a_damaged_model_gives_one_line_or_loads_whole(model: model_file.Model) -> None:
    undamaged, rng = model.to_bytes(), np.random.default_rng(0)
    for _ in range(120):
        data = bytearray(undamaged)
        if rng.random() < 0.3:
            data = data[:rng.integers(0, len(data))]
        for place in rng.integers(0, max(len(data), 1), size=rng.integers(1, 5)):
            data[place:place + 1] = bytes([rng.integers(0, 256)])
        try:
            loaded = model_file.parse(bytes(data), "x.npz")
        except AirTouchError as error:
            assert "\n" not in str(error)
        else:
            assert loaded.int8.input_shape == (100, 3, 1)


def arrays_of(model: model_file.Model) -> dict[str, np.ndarray]:
    import io

    with np.load(io.BytesIO(model.to_bytes())) as file:
        return {name: file[name] for name in file.files}


@pytest.mark.parametrize("name,change,message", [
    ("conv2.kernel", lambda a: a[:, :, :8], "another shape"),
    ("int8.dense1.weights", lambda a: a[:, :1000], "another shape"),
    ("dense1.bias", lambda a: a * np.nan, "not finite"),
    ("dense1.kernel", lambda a: a.astype(np.float64), "float64"),
    ("int8.scale", lambda a: -a, "positive"),
    ("int8.zero_point", lambda a: a + 300, "zero points"),
    ("int8.conv1.bias", lambda a: np.full_like(a, 2**31 - 1), "out of range"),
    ("metadata", lambda a: np.frombuffer(b"{", np.uint8), "how it was made"),
    ("metadata", lambda a: np.frombuffer(b'{"format": 9, "normalisation": ""}', np.uint8), "format 9"),
    ("tflite", None, "TFLite"),
    ("conv1.kernel", None, "no array"),
])
def test_a_wrong_array_is_named(
    model: model_file.Model, tmp_path: Path, name: str, change: Callable | None, message: str
) -> None:
    arrays: dict[str, Any] = dict(arrays_of(model))
    if change is None:
        del arrays[name]
    else:
        arrays[name] = change(arrays[name])
    np.savez(tmp_path / "wrong.npz", **arrays)
    with pytest.raises(AirTouchError, match=message) as error:
        model_file.load(tmp_path / "wrong.npz")
    assert str(error.value).startswith(str(tmp_path / "wrong.npz")) and "\n" not in str(error.value)


def test_pickled_and_missing_files_are_refused(tmp_path: Path) -> None:
    np.savez(tmp_path / "pickled.npz", metadata=np.array([{}], dtype=object))
    for path in (tmp_path / "pickled.npz", tmp_path / "none.npz", tmp_path):
        with pytest.raises(AirTouchError):
            model_file.load(path)


@pytest.mark.parametrize("changed, message", [
    ({"lag_s": "late"}, "lag_s is 'late', not a number"), ({"lag_s": 1e6}, "lag_s"), ({"sigma_s": None}, "sigma_s"),
    ({"flights": 3}, "flights is not a list"), ({"held_out_hashes": [1]}, "held_out_hashes is not a list"),
    ({"parameters": {"dwell_samples": 25.5}}, "dwell_samples is 25.5, not a whole number"),
    ({"parameters": {"arm_samples": -1}}, "arm_samples is -1"), ({"parameters": []}, "settings are not a table"),
    ({"parameters": {"probability_entry": "high"}}, "probability_entry is 'high'"),
])
def test_metadata_of_the_wrong_kind_are_named(model: model_file.Model, changed: dict, message: str) -> None:
    data = replace(model, metadata={**model.metadata, **changed}).to_bytes()
    with pytest.raises(AirTouchError, match=message) as error:
        model_file.parse(data, "m.npz")
    assert str(error.value).startswith("m.npz: ") and "\n" not in str(error.value)
