"""The shipped library: for which flights it holds, that it is no older than the code, and what it names end to end.

Sizes of distances by chi^2, densities by SciPy, and what the rounding of a file costs, on made libraries.
"""

import io
import pickle
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2, multivariate_normal

import axis_library
from airtouch.gap.evidence.data import Data
from airtouch.gap.features.feature_space import Standard
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
    assert reloaded.pair_distance_scatter == shipped.pair_distance_scatter
    for share in library.SHARE_FIELDS:
        assert [getattr(c.calibration, share) for c in reloaded.model.classes] \
            == [getattr(c.calibration, share) for c in shipped.model.classes]


@pytest.mark.parametrize("name", library.SHARE_FIELDS)
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
    hovering = [features(ready(log, VEHICLE), VEHICLE)
                for log in batch.flights("hover", 2, vehicle=VEHICLE, seed=77, workers=1)]
    for vehicle, flights in ((heavier, nominal), (VEHICLE, hovering), (VEHICLE, [*nominal, None]), (VEHICLE, [None]),
                             (VEHICLE, [])):
        assert library.library_for(vehicle, flights) is None


def test_a_vehicle_goes_by_what_it_is_declared_not_by_its_name(nominal):
    assert library.library_for(replace(VEHICLE, name="mine"), nominal) is library.shipped()


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
    recorded = study.with_scatter(replace(study.scatter, exact=False))
    assert inference_of(replace(data, study=recorded), list(all_candidates())) is None


def test_excess_distance_is_what_a_normal_density_loses():
    """From the median nominal flight to a flight: the difference of SciPy's log densities, nats."""
    of, flight = axis_library.library(), 1.3 * axis_library.noise(3)
    density = multivariate_normal(np.zeros(axis_library.Q), np.eye(axis_library.Q))
    at_median = np.sqrt(of.distance.median) * np.eye(axis_library.Q)[0]
    assert of.excess(flight @ flight) == pytest.approx(density.logpdf(at_median) - density.logpdf(flight))


def test_excess_distance_of_nominal_flights_scatters_as_half_of_chi_squared():
    of, rng = axis_library.library(), np.random.default_rng(5)
    excess = [of.excess(x @ x) for x in rng.normal(size=(20_000, axis_library.Q))]
    assert np.std(excess) == pytest.approx(0.5 * chi2(axis_library.Q).std(), rel=0.03)
    assert of.nominal_excess_deviation == pytest.approx(np.std(excess), rel=0.03)
    # a class adds its own, independent: a triangle of sides 3 and 4
    share = 4.0 / 3.0 * of.nominal_excess_deviation / 500.0
    assert of.excess_deviation(share, 500.0) == pytest.approx(5.0 / 3.0 * of.nominal_excess_deviation)


@pytest.mark.parametrize(("deviations", "nominal"), [(0.0, True), (3.5, True), (4.5, False)])
def test_flights_lie_as_nominal_up_to_four_standard_deviations_of_chi_squared(deviations, nominal):
    """Moved by a shift d, squared distances have d^2 more on average (noncentral chi^2)."""
    of, rng = axis_library.library(), np.random.default_rng(6)
    shift = np.sqrt(deviations * chi2(axis_library.Q).std()) * np.eye(axis_library.Q)[0]
    assert of.lies_as_nominal(shift + rng.normal(size=(2000, axis_library.Q))) == nominal


def test_the_choice_among_the_classes_of_an_effect_costs_its_logarithm():
    first, *others = axis_library.library().model.classes
    four = [replace(first, shape=float(i)) for i in range(4)]
    cost = axis_library.library().with_classes([*four, *others]).choice_cost
    assert cost["mass"] == pytest.approx(np.log(4.0)) and cost["wind"] == 0.0


def test_a_file_moves_coordinates_and_curves_by_little():
    """Half precision: by less than a tenth of a nominal deviation, and by a few ten-thousandths of a curve."""
    many, rng = 2000, np.random.default_rng(7)
    axes = np.linalg.qr(rng.normal(size=(many, axis_library.Q)))[0]
    standard = Standard(rng.normal(size=many), np.exp(rng.normal(size=many)))
    exact = replace(axis_library.library(), coordinates=library.Coordinates(standard, axes, np.zeros(axis_library.Q)))
    stored = library.read(library.packed(exact))
    flights = standard.middle + standard.deviation * rng.normal(size=(50, many))
    moved = stored.coordinates(flights) - exact.coordinates(flights)
    assert 0.0 < np.sqrt(np.mean(moved ** 2)) < 0.1
    np.testing.assert_array_equal(exact.coordinates.rounded()(flights), stored.coordinates(flights))
    strength = np.array([[0.7], [20.0]])
    for one, other in zip(exact.model.classes, stored.model.classes, strict=True):
        np.testing.assert_allclose(other.mean(strength), one.mean(strength), rtol=1e-3, atol=1e-9)
