"""What a library is learned by, on draws of a known covariance; a small library, learned from few flights; its file."""

from types import SimpleNamespace

import numpy as np
import pytest

import axis_library
from airtouch.errors import in_one_line
from airtouch.gap.features import flight_features
from airtouch.gap.features.feature_space import Standard
from airtouch.gap.relations import build, calibration, learning
from airtouch.gap.relations.build import (
    LEAST_NAMELESS_LENGTH,
    PairedFlights,
    Whitening,
    _interaction,
    loadings_beyond_noise,
    nameless_loadings,
)
from airtouch.gap.relations.inference import infer
from airtouch.gap.relations.learning import Scene, drawings, fly
from airtouch.gap.relations.library import read
from airtouch.gap.relations.settings import BuildSettings, CalibrationSettings
from airtouch.simulation.effects import activate
from gap_flights import VEHICLE

#: begins of the names of 28 features that show a mass and noise: 50 nominal flights tell their covariance
FEW_FEATURES = ("roll power force", "climb power force", "force x follows one", "force y follows one",
                "force z follows one", "force z follows thrust")
FEW_FLIGHTS = BuildSettings(
    nominal_flights=50, nameless_flights=10, flights_of_two=4, flights_per_knot=4, weakest_flights=1,
    calibration=CalibrationSettings(nominal_flights=12, class_flights=10, flights_with_second=2, flights_of_two=3,
                                    flights_per_strength=1, least_flights=4))
SCENE = Scene("hover", VEHICLE)
NOT_LEARNED_FROM = 7_000_000  #: number of the first flight that is judged
JUDGED = 6  #: flights with each effect


def test_whitened_flights_have_covariance_one():
    rng = np.random.default_rng(1)
    mix = np.eye(4) + 0.5 * rng.normal(size=(4, 4))
    features = 3.0 + 0.1 * rng.normal(size=(20_000, 4)) @ mix.T
    whitening = Whitening(Standard(np.full(4, 3.0), np.full(4, 0.1)), np.linalg.cholesky(mix @ mix.T))
    assert np.cov(whitening(features).T) == pytest.approx(np.eye(4), abs=0.05)
    assert whitening(features[0]) == pytest.approx(whitening(features)[:1])


def test_two_effects_interact_in_the_direction_that_stands_over_noise():
    rng = np.random.default_rng(2)
    noise = 0.05 * rng.normal(size=(300, 40))
    assert loadings_beyond_noise(noise, 0.05 ** 2).shape == (40, 0)
    direction = np.eye(40)[3]
    loadings = loadings_beyond_noise(noise + 0.3 * rng.normal(size=(300, 1)) * direction, 0.05 ** 2)
    assert loadings.shape == (40, 1)
    assert abs(loadings[3, 0]) == pytest.approx(0.3, rel=0.1)


def test_pairs_of_which_none_can_be_used_have_no_interaction():
    """No flight was made, as where all of two effects crash."""
    coordinates = SimpleNamespace(projection=np.zeros((9, 4)))
    assert _interaction(None, coordinates, None, [], 0).shape == (4, 0)


def test_nameless_disturbances_scatter_by_their_directions_not_their_lengths():
    rng = np.random.default_rng(3)
    length = np.exp(rng.uniform(2.0, 8.0, (500, 1)))
    shift = length * np.where(rng.random((500, 1)) < 0.8, np.eye(5)[0], np.eye(5)[1])
    weak = 0.9 * LEAST_NAMELESS_LENGTH * np.tile(np.eye(5)[4], (500, 1))
    loadings = nameless_loadings(np.concatenate([shift, weak]))
    assert np.diag(loadings @ loadings.T) == pytest.approx([0.8, 0.2, 0.0, 0.0, 0.0], abs=0.05)


def test_effects_of_a_pair_are_of_the_upper_half_of_their_strengths():
    (drawing,) = drawings("mass")
    none = np.zeros((0, 1))
    paired = PairedFlights(drawing, none, none, none, (0.001, 0.1))
    strengths = [paired.draw_strong(np.random.default_rng(i)).values["fraction"] for i in range(200)]
    assert 0.01 <= min(strengths) < 0.011 and 0.09 < max(strengths) <= 0.1


@pytest.fixture(scope="module")
def infer_new_flights():
    """A function: what a library of two effects, learned from some 170 hovers, infers in new flights with effects.

    But for the counts, the features and the effects all is as in the whole library.
    """
    declared, whole = flight_features.declared_features(), learning.features
    few = [i for i, f in enumerate(declared) if f.name.startswith(FEW_FEATURES)]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(flight_features, "declared_features", lambda: tuple(declared[i] for i in few))
        patch.setattr(learning, "features", lambda flight, vehicle: whole(flight, vehicle)[few])
        for module in (build, calibration):
            patch.setattr(module, "all_drawings", lambda: [d for e in ("mass", "imu_noise") for d in drawings(e)])
        steps: list[str] = []
        library = build.build(SCENE, FEW_FLIGHTS, steps.append)
        assert [step.partition(":")[0] for step in steps if ": " in step] == [
            "1 of 2", "2 of 2", "calibration, 1 of 2", "calibration, 2 of 2"]

        def inferences(effects):
            new = [fly(SCENE, NOT_LEARNED_FROM + i, activate(effects)) for i in range(JUDGED)]
            return [infer(library, library.coordinates(flight[None])) for flight in new]

        yield inferences


@pytest.mark.parametrize("effects", [{"mass": {"fraction": 0.1}}, {"imu_noise": {"factor": 1.5}}])
def test_an_effect_that_a_library_was_built_with_is_named_and_sized(infer_new_flights, effects):
    answers = infer_new_flights(effects)
    ((name, ((parameter, true),)),) = ((name, values.items()) for name, values in effects.items())
    assert [[c.name for c in one.classes] for one in answers] == [[name]] * JUDGED
    assert sum(one.counterevidence.is_too_much for one in answers) <= 1
    for value, deviation in (one.readings[name][parameter] for one in answers):
        assert value == pytest.approx(true, rel=0.3) and abs(value - true) < 3.0 * deviation


def test_a_library_built_of_few_flights_names_nothing_in_nominal_ones(infer_new_flights):
    answers = infer_new_flights({})
    assert not any(one.classes for one in answers) and sum(one.counterevidence.is_too_much for one in answers) <= 1


def test_an_effect_that_a_library_was_built_without_is_left(infer_new_flights):
    assert all(one.counterevidence.is_too_much for one in infer_new_flights({"wind": {}}))


def test_a_file_that_is_there_is_refused_before_the_work(tmp_path, monkeypatch, capsys):
    """One line and exit code 2, and nothing is flown."""
    out = tmp_path / "one.npz"
    out.write_bytes(b"mine")
    monkeypatch.setattr(build, "build", lambda *_, **__: pytest.fail("half an hour of work"))
    monkeypatch.setattr("sys.argv", ["build", str(out)])
    with pytest.raises(SystemExit) as end, in_one_line("build"):
        build.main()
    assert capsys.readouterr().err == f"build: {out}: exists already; use --force to replace it\n"
    assert end.value.code == 2 and out.read_bytes() == b"mine"


def test_a_library_is_written_in_place_of_another_by_force(tmp_path, monkeypatch, capsys):
    out = tmp_path / "one.npz"
    out.write_bytes(b"old")
    monkeypatch.setattr(build, "build", lambda *_, **__: axis_library.library())
    monkeypatch.setattr("sys.argv", ["build", str(out), "--force"])
    build.main()
    assert [c.name for c in read(out.read_bytes()).model.classes] == list(axis_library.NAMES)
    assert capsys.readouterr().out.count("nameless share 0.000") == len(axis_library.NAMES)
