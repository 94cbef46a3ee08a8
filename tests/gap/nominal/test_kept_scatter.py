"""The scatter of a baseline is measured once, and anew where anything differs that it depends on."""

from dataclasses import asdict, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from airtouch.gap.nominal import kept_scatter as module
from airtouch.gap.nominal.kept_scatter import MOST, VARIABLE, digest_of, folder_of, kept_scatter, scatter_from
from airtouch.gap.signatures.scatter import Scatter
from airtouch.simulation import effects
from gap_flights import VEHICLE
from hovers import hover

MEASURED = Scatter({"mass": np.array([0.1 + 0.2]), "wind": np.array([1e-17, np.pi, np.inf])}, 7.0, (1 / 3, 0.5),
                   {"gust": (0.1, np.float64(2.0))}, "", {"gust": np.array([0.3])}, True)


class Measurement:
    """Counts how often it was made."""

    def __init__(self, scatter=MEASURED):
        self.scatter, self.count = scatter, 0

    def __call__(self):
        self.count += 1
        return self.scatter


@pytest.fixture(scope="module")
def flight():
    return hover(3, length_s=5.0)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, str(tmp_path / "kept"))
    return tmp_path / "kept"


def values(scatter):
    """What a scatter holds, arrays as bytes, to be compared to the bit."""
    return repr({k: {n: np.asarray(v, float).tobytes() for n, v in part.items()} if isinstance(part, dict)
                 else part for k, part in asdict(scatter).items()})


def test_the_same_baseline_is_measured_once_and_equal_to_the_bit(flight, folder):
    measure = Measurement()
    first = kept_scatter(VEHICLE, [flight], ("wind",), measure)
    second = kept_scatter(VEHICLE, [flight], ("wind",), measure)
    assert measure.count == 1 and values(first) == values(second) == values(MEASURED)


def test_whatever_differs_gives_another_key(flight):
    """One sample of each array and of each column of the log, the log's origin, the vehicle, what is left out."""
    same = digest_of(VEHICLE, [flight], ())
    assert same == digest_of(VEHICLE, [replace(flight)], ())
    changed = []
    for name, array in vars(flight).items():
        if isinstance(array, np.ndarray) and array.size:
            other = array.copy()
            other.flat[-1] = not other.flat[-1] if array.dtype == bool else other.flat[-1] + 1
            changed.append(replace(flight, **{name: other}))
    assert len(changed) > 5
    for name, column in flight.log.columns.items():
        changed.append(replace(flight, log=flight.log.with_columns({name: column + 1.0})))
    changed.append(replace(flight, log=replace(flight.log, meta={**flight.log.meta, "format": "usd"})))
    keys = [digest_of(VEHICLE, [f], ()) for f in changed]
    keys += [digest_of(replace(VEHICLE, mass_kg=0.0301), [flight], ()), digest_of(VEHICLE, [flight], ("wind",)),
             digest_of(VEHICLE, [flight, flight], ()), digest_of(VEHICLE, [], ())]
    assert len({same, *keys}) == len(keys) + 1


def test_a_firmware_file_that_changes_gives_another_key(flight, tmp_path):
    own = replace(VEHICLE, firmware=str(tmp_path / "own.toml"))
    (tmp_path / "own.toml").write_text("one")
    before = digest_of(own, [flight], ())
    (tmp_path / "own.toml").write_text("other")
    assert digest_of(own, [flight], ()) != before


def test_beside_an_effect_of_the_users_own_nothing_is_kept(flight, folder):
    own = effects.register(replace(effects.get("mass"), name="own_mass"))
    try:
        measure = Measurement()
        for _ in range(2):
            kept_scatter(VEHICLE, [flight], (), measure)
        assert measure.count == 2 and not folder.exists()
        kept_scatter(VEHICLE, [flight], (own.name,), measure)
        assert len(list(folder.iterdir())) == 1
    finally:
        effects.unregister(own.name)


@given(st.one_of(st.binary(max_size=40), st.recursive(
    st.none() | st.booleans() | st.floats() | st.text(max_size=3) | st.sampled_from(sorted(asdict(MEASURED))),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(
        st.sampled_from(sorted(asdict(MEASURED))), inner)).map(lambda v: module.json.dumps(v).encode())))
def test_any_bytes_are_a_scatter_or_are_measured_anew(data):
    try:
        assert isinstance(scatter_from(data), Scatter)
    except ValueError:
        pass


def test_a_broken_file_is_measured_anew_and_replaced(flight, folder):
    measure = Measurement()
    kept_scatter(VEHICLE, [flight], (), measure)
    (path,) = folder.iterdir()
    whole = path.read_bytes()
    path.write_bytes(whole[:-3])
    assert values(kept_scatter(VEHICLE, [flight], (), measure)) == values(MEASURED)
    assert measure.count == 2 and path.read_bytes() == whole


def test_where_nothing_can_be_written_it_is_measured(flight, tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv(VARIABLE, str(tmp_path / "file"))
    measure = Measurement()
    assert kept_scatter(VEHICLE, [flight], (), measure) is MEASURED and measure.count == 1


def test_the_oldest_go_first(flight, folder):
    folder.mkdir()
    for i in range(MOST):
        old = folder / f"scatter-{i}.json"
        old.write_text("")
        module.os.utime(old, (i, i))
    kept_scatter(VEHICLE, [flight], (), Measurement())
    assert len(list(folder.iterdir())) == MOST and not (folder / "scatter-0.json").exists()
    assert (folder / "scatter-1.json").exists()


def test_folder_of_the_environment(tmp_path):
    assert folder_of({VARIABLE: "", "XDG_CACHE_HOME": "x"}) is None
    assert folder_of({VARIABLE: "there", "XDG_CACHE_HOME": "x"}).name == "there"
    assert folder_of({"XDG_CACHE_HOME": str(tmp_path)}) == tmp_path / "airtouch"
    assert folder_of({}).parts[-2:] == (".cache", "airtouch")
