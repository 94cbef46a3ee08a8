"""Effects in flights whose control loop is modelled: those of the loop, which the commands show, and another."""


import pytest

from airtouch.gap.naming import policy
from airtouch.gap.signatures.scatter import Scatter
from airtouch.simulation import effects
from gap_flights import fly
from hovers import STIFF, own_gain, select_from


@pytest.mark.parametrize(("name", "parameter", "value"), [
    ("sensor_latency", "delay", 0.008), ("controller_gain", "rate", 0.6)])
def test_loop_effect_is_named_by_the_commands(flying, name, parameter, value):
    selection, data = select_from(fly(1, 2, {name: {parameter: value}}), (name, "mass"), flying)
    (step,) = selection.steps
    assert step.name == name and step.is_named and selection.spectrum_is_assumed
    assert selection.policy.unknown.least == pytest.approx(12.0 * 5 / 3), "of four nominal flights"
    assert step.terms[0].values[parameter] == pytest.approx(value, rel=0.2)
    assert set(selection.least_nats.values()) == {policy.LEAST_GAIN}, "as in recorded flights"
    assert step.evidence == step.gain  # nothing is known of nominal flights' scatter
    free = len(step.terms[0].free)
    price = (free - 1) * policy.PRICE + step.charges.choice_cost
    assert step.gain == pytest.approx(own_gain(data, step.terms) - price, rel=0.05)


def test_effect_that_only_the_commands_show_is_fitted(flying, tmp_path):
    file = tmp_path / "stiff_climb.py"
    file.write_text(STIFF, encoding="utf-8")
    effects.load_file(file)
    try:
        selection, _ = select_from(fly(1, 4, [("stiff_climb", {"factor": 2.5})]), ("stiff_climb", "mass"), flying)
    finally:
        effects.unregister("stiff_climb")
    (step,) = selection.steps
    assert step.name == "stiff_climb" and step.full and step.charges.choice_cost == 0.0
    assert step.terms[0].values["factor"] == pytest.approx(2.5, rel=0.35)


@pytest.mark.parametrize("simulated", [True, False])
def test_changed_loop_is_assumed_in_recorded_flights(flying, simulated):
    study = flying.with_scatter(Scatter({}, 8.0, (0.0, 0.0), exact=simulated))
    selection, _ = select_from(fly(1, 2, {"sensor_latency": {"delay": 0.008}}), ("sensor_latency",), study)
    assert [s.name for s in selection.steps] == ["sensor_latency"] and selection.spectrum_is_assumed is not simulated


def test_turbulent_ground_effect_is_named(flying):
    shaking = {"ground_effect": {"strength": 0.8, "fade": 0.0875, "turbulence": 1.0}}
    selection, _ = select_from(fly(1, 12, shaking), ("ground_effect", "mass"), flying)
    first = selection.steps[0]
    assert first.name == "ground_effect" and first.terms[0].values["strength"] == pytest.approx(0.8, rel=0.35)
