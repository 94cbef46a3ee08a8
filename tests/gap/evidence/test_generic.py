"""The model without names: against closed forms, nominal flights of other seeds, and effects that nobody named."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from airtouch.gap.diagnose import brief
from airtouch.gap.evidence import clock, fit, generic
from airtouch.gap.evidence.data import Data
from airtouch.gap.naming.judging import halves
from airtouch.gap.signatures import candidates
from airtouch.simulation import effects
from airtouch.simulation import signals as at
from airtouch.simulation.effects import Effect, Parameter, wrench
from gap_flights import VEHICLE, flown

PUSH = 0.01  #: N s/m


@wrench
def _sideways(p, s, memory, stream, out):
    out[1] += p[0] * s[at.VELOCITY]


@pytest.fixture
def sideways():
    """A made-up effect: forward speed pushes to the left."""
    made = effects.register(Effect("sideways", "forward speed pushes to the left",
                                   (Parameter("push", "N s/m", PUSH, 0.0, 1.0, 0.0, "per forward speed"),),
                                   wrench=_sideways))
    yield made
    effects.unregister("sideways")


def gain_of(study, flights):
    data = Data(study, flights)
    return sum(generic.generic_gain(data, halves(data), [(), ()]))


def test_power_factor_of_gaussian_values_is_their_power_and_stays_where_it_is_believed():
    rng = np.random.default_rng(1)
    n, groups = 4000, np.repeat([3, 7], 2000)
    power = np.where(groups == 3, 2.5, 0.4) * rng.exponential(size=n)
    free, level = generic.power_factors(power, np.full(n, 1e6), np.full(n, 1e6), groups, *generic.LOOSE)
    np.testing.assert_allclose(free[[3, 7]], np.log([2.5, 0.4]), atol=4.0 / np.sqrt(2000))
    still, at_rest = generic.power_factors(power, np.full(n, 1e6), np.full(n, 1e6), groups, np.zeros(generic.GROUPS),
                                      np.full(generic.GROUPS, 1e-6))
    np.testing.assert_allclose(still[[3, 7]], 0.0, atol=1e-3)
    expected = [0.5 * 2000 * (f - 1.0 - np.log(f)) for f in (2.5, 0.4)]  # Kullback-Leibler, half overlapping blocks
    np.testing.assert_allclose((level - at_rest)[[3, 7]], expected, rtol=0.15)


def test_what_may_be_there_gains_half_and_costs_log_two_at_most():
    assert generic.gain_at_even_odds(0.0) == 0.0
    np.testing.assert_allclose(generic.gain_at_even_odds(-50.0), -np.log(2.0))
    np.testing.assert_allclose(generic.gain_at_even_odds(50.0), 50.0 - np.log(2.0))


def test_columns_are_the_signals_that_they_are_named_after():
    one = flown(1, 43)[0]
    made = dict(zip(generic.BASIS, generic.basis(one, VEHICLE).transpose(1, 0, 2), strict=True))
    hover = np.flatnonzero(one.phase == 2)
    assert np.all(made["in_air"][one.on_ground] == 0.0) and np.all(made["one"] == 1.0)
    assert abs(made["thrust"][hover, 0].mean() - 1.0) < 0.1  # of its weight
    np.testing.assert_allclose(made["vx"][hover, 1], one.signals[hover, at.VELOCITY])
    rows = np.stack([made[k][hover] for k in ("world_x", "world_y", "tilt")], axis=1)
    np.testing.assert_allclose(np.linalg.norm(rows, axis=2), 1.0, rtol=1e-9)  # rows of a rotation


def test_nominal_flights_of_other_seeds_have_nothing_left(study):
    assert max(gain_of(study, [f]) for f in flown(6, 57)) < 10.0


def test_an_effect_without_a_name_is_measured_and_called_unknown(study, sideways):
    """Its coefficient is force per mass; with the effect in the registry it is named instead."""
    one = flown(1, 45, {"sideways": {"push": PUSH}})
    data = Data(study, one)
    found = [generic.coefficients(generic.HalfResiduals(data, p, ()), 1, study.usual)[generic.BASIS.index("vx")]
             for p in halves(data)]
    np.testing.assert_allclose(found, PUSH / VEHICLE.mass_kg, rtol=0.35)
    assert gain_of(study, one) > 30.0
    named, nameless = (brief(study, one, without, data) for without in ((), ("sideways",)))
    chance, without_name = ({r.name: r.probability for r in d.ranking}["unknown"] for d in (named, nameless))
    assert nameless.verdict == "unknown" and without_name > 0.85
    assert named.verdict == "effect" and named.effects[0].name == "sideways" and chance < 0.1


def test_a_little_noise_in_every_band_shows_in_the_sensors_sum(study, monkeypatch):
    """A tenth more power in every band of every sensor: no band alone tells it from chance."""
    data = Data(study, flown(1, 49, {"imu_noise": {"factor": 1.06}}))
    together = gain_of(study, data.flights)
    monkeypatch.setattr(generic, "_of_sensors", lambda powers, middle: middle)
    assert together > 15.0 > gain_of(study, data.flights)


def test_torque_that_answers_the_commands_otherwise_shows_in_simulated_flights(study):
    """Half as much inertia again; recorded flights' loop is not modelled as well."""
    data = Data(study, flown(1, 50, {"inertia": {"fraction": 0.5}}))
    found = [generic.coefficients(generic.HalfResiduals(data, p, ()), 4, study.usual) for p in halves(data)]
    assert all(f[len(generic.BASIS):].any() for f in found)
    among = np.arange(generic.WIDEST) < len(generic.BASIS)
    recorded = [generic.coefficients(generic.HalfResiduals(data, p, ()), 4, study.usual, among)
                for p in halves(data)]
    assert not any(f[len(generic.BASIS):].any() for f in recorded)


def test_an_effect_with_its_name_beats_the_model_without(study):
    data = Data(study, flown(1, 47, {"com_offset": {"x": 0.001, "y": 0.0}}))
    parts = halves(data)
    (term,) = candidates.terms("com_offset")
    fits = [fit.fit(data, p, (term,)) for p in parts]
    named = sum(fit.judge(data, parts[1 - k], f.terms) - fit.judge(data, parts[1 - k], ()) for k, f in enumerate(fits))
    before = sum(generic.generic_gain(data, parts, [(), ()]))
    after = sum(generic.generic_gain(data, parts, [f.terms for f in fits]))
    assert 30.0 < before < named and after < 0.15 * named


def test_clock_and_losses_count_as_unknown_only_where_they_are_not_named():
    rng = np.random.default_rng(2)
    times, lost = rng.normal(0.0, 4e-3, 2000), rng.random(2000) < 0.05
    floor = SimpleNamespace(clock_s=1e-3, lost=1e-3)
    data = SimpleNamespace(flights=[SimpleNamespace(clock_s=times, lost=lost)],
                           study=SimpleNamespace(floor=floor, controller=None))
    extra, gain = clock.jitter(data)
    np.testing.assert_allclose(extra, np.sqrt(4.0 ** 2 - 1.0) * 1e-3, rtol=0.05)
    share, more = clock.loss(data)
    np.testing.assert_allclose(share, 0.05, rtol=0.3)
    assert clock.clock_left(data, ()) == gain + more
    assert clock.clock_left(data, ("time_jitter", "packet_loss")) == 0.0


def beside(study, term, given, seed):
    """What columns gain beside an effect, without and with those that the effect itself makes."""
    data = Data(study, flown(1, seed, {term.name: given}))
    parts = halves(data)
    fits = [fit.fit(data, p, [term]).terms for p in parts]
    kept = generic.generic_gain(data, parts, fits)[0]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(generic, "_answerable", lambda *_: np.ones(generic.WIDEST, bool))
        return kept, generic.generic_gain(data, parts, fits)[0]


def test_what_answers_a_random_torque_is_not_new_beside_it(study):
    """Torque of the motors' own noise is in the commands that fight it, so that what is left follows them."""
    term = next(t for t in candidates.terms("motor_noise") if t.values["time"] == 0.02)
    kept, asked = beside(study, term, {"rms": 0.003}, 51)
    assert kept < 5.0 and asked > 20.0


def test_how_changed_gains_turn_the_vehicle_about_its_yaw_axis_is_not_asked(study):
    data, yaw = Data(study, flown(1, 52)), [generic.BASIS.index(n) for n in ("yaw", "d_yaw")]
    for name, values, asked in (("controller_gain", {"attitude": 1.4}, False), ("mass", {"fraction": 0.1}, True)):
        term = candidates.terms(name)[0]
        term = replace(term, values={**term.values, **values})
        assert (generic._answerable(data, [term], 5)[yaw] == asked).all()
        assert generic._answerable(data, [term], 4).all()  # roll and pitch are modelled
