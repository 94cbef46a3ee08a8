"""The shipped library: for which flights it holds, that it is no older than the code, and what it names end to end."""

import io
import pickle
from dataclasses import replace

import numpy as np
import pytest

import axis_library
from airtouch.gap.evidence.data import Data
from airtouch.gap.features.flight_features import declared_features, features
from airtouch.gap.naming.by_relations import inference_of
from airtouch.gap.naming.select import select
from airtouch.gap.relations import library
from airtouch.gap.relations.learning import drawings
from airtouch.gap.signatures.candidates import all_candidates
from airtouch.simulation import batch
from airtouch.simulation.effects import NAMES
from gap_flights import VEHICLE, fly, ready


@pytest.fixture(scope="module")
def nominal():
    """Features of nominal flights of a seed that nothing was learned from."""
    return [features(f, VEHICLE) for f in fly(5, 77)]


def test_another_process_reads_the_shipped_library_from_its_own_package():
    shipped = library.shipped()
    sent = pickle.dumps(shipped)
    assert len(sent) < 200 and pickle.loads(sent) is shipped
    part = shipped.without(["mass"])
    assert pickle.loads(pickle.dumps(part)).effects == part.effects == shipped.effects - {"mass"}


def test_a_file_holds_what_was_saved(tmp_path):
    shipped = library.shipped()
    library.save(shipped, tmp_path / "one.npz")
    reloaded = library.read((tmp_path / "one.npz").read_bytes())
    assert [c.name for c in reloaded.model.classes] == [c.name for c in shipped.model.classes]
    assert reloaded.coordinates.projection == pytest.approx(shipped.coordinates.projection)
    assert reloaded.effects == shipped.effects
    assert reloaded.pair_scatter == shipped.pair_scatter
    for share in library.SHARES:
        assert [getattr(c.calibration, share) for c in reloaded.model.classes] \
            == [getattr(c.calibration, share) for c in shipped.model.classes]


@pytest.mark.parametrize("name", library.SHARES)
def test_a_file_with_a_number_too_few_is_refused(name):
    with np.load(io.BytesIO(library.packed(axis_library.library()))) as file:
        arrays = dict(file)
    content = io.BytesIO()
    np.savez(content, **arrays | {name: arrays[name][1:]})
    with pytest.raises(ValueError, match=name):
        library.read(content.getvalue())


def test_the_file_is_of_todays_features_and_effects():
    """Else `python -m airtouch.gap.relations.build` makes a new one."""
    shipped = library.shipped()
    assert len(shipped.coordinates.standard.middle) == len(declared_features())
    assert {(c.name, c.shape) for c in shipped.model.classes} \
        == {(d.name, d.shape) for e in NAMES for d in drawings(e)}


def test_it_holds_for_nominal_flights_of_its_vehicle_and_scenario(nominal):
    assert library.library_for(VEHICLE, nominal) is library.shipped()


def test_it_does_not_hold_for_another_vehicle_mission_or_log(nominal):
    heavier = replace(VEHICLE, mass_kg=1.05 * VEHICLE.mass_kg)
    assert library.library_for(heavier, nominal) is None
    hovering = [features(ready(log, VEHICLE), VEHICLE)
                for log in batch.flights("hover", 2, vehicle=VEHICLE, seed=77, workers=1)]
    assert library.library_for(VEHICLE, hovering) is None
    assert library.library_for(VEHICLE, [*nominal, None]) is None
    assert library.library_for(VEHICLE, []) is None


def test_nominal_flights_lie_as_far_as_their_covariance_says(nominal):
    """The squared distance of a nominal flight has about as many degrees of freedom as there are coordinates."""
    shipped = library.shipped()
    coordinates = shipped.coordinates(np.array(nominal))
    assert np.median((coordinates ** 2).sum(axis=1)) == pytest.approx(shipped.distance.median, rel=0.15)
    assert shipped.distance.median == pytest.approx(coordinates.shape[1], rel=0.3)


@pytest.mark.parametrize("effects", [{"weak_motor": {"rotor": 2.0, "thrust_loss": 0.002}},
                                     {"controller_gain": {"position": 1.25}}, {"imu_noise": {"factor": 1.15}}])
def test_weak_effects_are_named_and_withheld_ones_are_not(study, effects):
    """Each too weak for the replay of a single flight; the other names of one that is withheld do not get it."""
    data, candidates = Data(study, fly(1, 78, effects)), all_candidates()
    selection = select(data, candidates)
    assert selection.inference is not None and [s.name for s in selection.named_steps] == list(effects)
    left_out = {n: v for n, v in candidates.items() if n not in effects}
    inference = inference_of(data, list(left_out))
    assert not set(effects) & set(inference.evidence)
    assert max(inference.evidence.values()) < selection.inference.evidence[next(iter(effects))]


def test_it_is_not_asked_where_it_cannot_answer(study):
    """In recorded flights, and where an effect is a candidate that it has no class of."""
    data = Data(study, fly(1, 79))
    assert inference_of(data, list(all_candidates())) is not None
    assert inference_of(data, [*all_candidates(), "an effect of one's own"]) is None
    recorded = replace(study, scatter=replace(study.scatter, exact=False))
    assert inference_of(replace(data, study=recorded), list(all_candidates())) is None
