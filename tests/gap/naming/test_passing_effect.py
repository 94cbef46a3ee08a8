"""Passing effects, in made flights with a push for some seconds: when one is named, and before what."""

from dataclasses import replace
from types import SimpleNamespace

import pytest
from scipy.stats import t as student

from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.judge import judge
from airtouch.gap.evidence.problem import whole_of
from airtouch.gap.naming import policy
from airtouch.gap.naming.passing_effect import outgained
from airtouch.gap.naming.records import Hypothesis, OutgainedPassing
from airtouch.gap.passing.gates import KNOWN_OVERHEAD, passing_effects
from airtouch.gap.signatures.scatter import FALSE_SHARE, size_of
from hovers import ALWAYS, FLOOR, scattered, select_from, with_a_push


def test_passing_effect_is_named_with_its_seconds():
    pushed = [with_a_push(9.0, 15.0)]
    selection, data = select_from(pushed, ("mass",), scattered(), ())
    assert [s.name for s in selection.named_steps] == ["downwash"]
    ((name, since, until),) = selection.steps[0].terms[0].gate
    assert name == "pushed" and since == pytest.approx(9.0, abs=1.3) and until == pytest.approx(15.0, abs=1.3)
    assert selection.steps[0].evidence > 2.0 * policy.FIRST_GAIN and "downwash" in selection.single_effects
    single = selection.single_effects["downwash"]
    without_price = judge(data, whole_of(data), single.terms) - judge(data, whole_of(data), (), True)
    assert single.charges.choice_cost > 0.0 and single.gain == pytest.approx(without_price - single.charges.choice_cost)
    assert selection.least_nats["downwash"] == policy.LEAST_GAIN
    for study, without in ((scattered(), ALWAYS), (FLOOR, ())):
        other, _ = select_from(pushed, ("mass",), study, without)
        assert "downwash" not in other.single_effects


@pytest.mark.parametrize(("size", "named"), [((0.0, 0.0), True), ((0.5, 0.1), True), ((3.0, 0.5), False)])
def test_size_must_exceed_that_of_nominal_flights(size, named):
    """size: mean and standard deviation of `size_of` in nominal flights."""
    study = scattered()
    study = study.with_scatter(replace(study.scatter, passing={"downwash": size}))
    selection, data = select_from([with_a_push(9.0, 15.0)], ("mass",), study, ())
    assert [s.name for s in selection.named_steps] == ["downwash"] * named
    assert ("downwash" in selection.single_effects) == named
    for step in selection.steps:
        beyond = study.scatter.unusual({"downwash": size_of(step.gain / data.seconds, step.strength.mean)})
        assert step.evidence == pytest.approx(policy.LEAST_GAIN + beyond, rel=0.01)


@pytest.mark.parametrize(("names", "nominal_sizes", "mps2", "named"), [
    (("mass",), {}, 0.5, ["mass"]), (("mass",), {"mass": [3.0]}, 0.5, ["downwash"]), (("imu_noise",), {}, 0.15, [])])
def test_passing_effect_must_gain_more_than_a_steady_one(names, nominal_sizes, mps2, named):
    """A push for 25 of 30 s, of which its mass gains more.

    A mass that nominal flights have as well does not count; what follows the flight's own height does.
    """
    pushed = with_a_push(0.0 if mps2 == 0.5 else 2.0, 25.0, mps2=mps2)
    selection, data = select_from([pushed], names, scattered(**nominal_sizes), ())
    assert [s.name for s in selection.named_steps] == named
    assert ("downwash" in selection.single_effects) == ("downwash" in named)
    outgained = {name: (passing.steady_name, passing.steady_gain) for name, passing in selection.outgained.items()}
    assert outgained.get("downwash") == (("mass", selection.single_effects["mass"].gain) if named == ["mass"] else None)
    for name, passing in selection.outgained.items():
        assert passing.gain == passing_effects(data)[name].gain < passing.steady_gain + policy.LEAST_GAIN


@pytest.mark.parametrize(("name", "counts"), [("wind", True), ("downwash", False)])
def test_passing_air_must_gain_more_than_the_same_air_all_along(name, counts):
    """A steady push that nominal flights have as well: it does not count beside a wake."""
    passing = SimpleNamespace(name=name, key=name, gain=100.0)
    steady = {n: Hypothesis(n, (), gain, evidence=evidence)
              for n, gain, evidence in (("wind", 90.0, 0.0), ("downwash", 90.0, 0.0), ("mass", 50.0, 20.0))}
    search = SimpleNamespace(single_effects=steady, least_nats=dict.fromkeys(steady, policy.LEAST_GAIN))
    beside_steady_air = {name: OutgainedPassing(100.0, name, 90.0)}
    assert outgained(search, [passing]) == (beside_steady_air if counts else {})
    passing.gain = 90.0 + policy.LEAST_GAIN
    assert outgained(search, [passing]) == {}


@pytest.mark.parametrize(("less", "named"), [(policy.LEAST_GAIN - 1.0, []), (policy.LEAST_GAIN + 1.0, ["downwash"])])
def test_passing_effect_must_gain_more_than_the_height(monkeypatch, less, named):
    """Something that follows the flight's own height is told to gain a little less than a push for 6 of 30 s."""
    flights, study = [with_a_push(9.0, 15.0)], scattered()
    gain = passing_effects(Data(study, flights))["downwash"].gain
    monkeypatch.setattr("airtouch.gap.naming.passing_effect.height_gain", lambda *_: gain - less)
    assert [s.name for s in select_from(flights, (), study, ())[0].named_steps] == named


@pytest.mark.parametrize("nominal_sizes", [{}, {"mass": [3.0]}])
def test_passing_effect_is_dropped_where_its_leave_one_out_size_is_nominal(nominal_sizes):
    """A push all along, harder for half of the flight: the harder half alone gains most, and less beside a mass.

    So it does beside a mass that is not named, as nominal flights have it as well.
    """
    harder = with_a_push(8.0, 23.0, mps2=0.35)
    flights = [replace(harder, acceleration=harder.acceleration - [0.0, 0.0, 0.2])]
    selection, data = select_from(flights, ("mass",), scattered(**nominal_sizes), ())
    wake, mass = selection.steps
    of_wake, of_mass = wake.leave_one_out_gain, mass.leave_one_out_gain or 0.0
    assert (wake.name, mass.name) == ("downwash", "mass") and mass.is_named != bool(nominal_sizes)
    assert of_mass < of_wake < 0.9 * wake.gain
    rates = (nats / data.seconds for nats in (of_mass, of_wake, wake.gain))
    least, share, gain = (size_of(rate, wake.strength.mean) for rate in rates)

    def names_where_nominal_flights_have(size):
        """FALSE_SHARE of the nominal flights have a larger one."""
        study, spread = scattered(**nominal_sizes), 0.1
        middle = size - spread * student.ppf(1.0 - FALSE_SHARE, study.scatter.freedom)
        study = study.with_scatter(replace(study.scatter, passing={"downwash": (middle, spread)}))
        return {s.name for s in select_from(flights, ("mass",), study, ())[0].steps}

    assert names_where_nominal_flights_have(0.5 * (share + gain)) == {"mass"}
    assert names_where_nominal_flights_have(0.5 * (least + share)) == {"mass", "downwash"}


@pytest.mark.parametrize(("overhead", "key", "since_s"), [
    ((9.0, 12.0), KNOWN_OVERHEAD, 9.0), ((20.0, 22.0), "downwash", 9.04)])
def test_known_seconds_go_before_likely_ones(overhead, key, since_s):
    """A push from 9 to 15 s: the known half of it gains less than all of it, and pays for no search."""
    study = replace(scattered(), overhead=(("pushed", *overhead),))
    selection, _ = select_from([with_a_push(9.0, 15.0)], ("mass",), study, ())
    (step,) = selection.named_steps
    assert step.passing_key == key and step.terms[0].gate[0][1] == pytest.approx(since_s, abs=1e-9)
    assert (step.charges.choice_cost == 0.0) == (key == KNOWN_OVERHEAD)


def test_known_seconds_need_no_leave_one_out_gain():
    """The harder half of a push that goes on all along, in the seconds under another vehicle, beside its mass."""
    harder = with_a_push(8.0, 23.0, mps2=0.35)
    flights = [replace(harder, acceleration=harder.acceleration - [0.0, 0.0, 0.2])]
    study = replace(scattered(mass=[3.0]), overhead=(("pushed", 8.0, 23.0),))
    wake, mass = select_from(flights, ("mass",), study, ())[0].steps
    assert (wake.passing_key, wake.is_named, mass.name, mass.is_named) == (KNOWN_OVERHEAD, True, "mass", False)
    assert wake.leave_one_out_gain is None
