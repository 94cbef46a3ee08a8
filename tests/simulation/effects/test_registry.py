"""The registry: names, bounds, units, strength, and an effect of a user's own."""

import numpy as np
import pytest

from airtouch.errors import AirTouchError
from airtouch.simulation import effects, flight, replay, scenario, stepper
from airtouch.simulation import signals as at

GAP_LIST = {
    "ground_effect", "rotor_drag", "wind", "gust", "blade_flapping", "motor_lag", "motor_noise",
    "thrust_coefficient",
    "weak_motor", "battery_sag", "mass", "com_offset", "inertia", "slung_load", "imu_bias", "imu_noise",
    "vibration",
    "sensor_latency", "actuator_delay", "time_jitter", "packet_loss", "range_step", "flow_scale",
    "controller_gain", "downwash", "range_bias", "flow_latency",
}
SHORT = """
name = "short"
[[platform]]
size_m = [1.0, 2.0]
centre_m = [0.8, 0.0]
top_m = 0.45
[[mission.step]]
do = "take-off"
height_m = 0.5
time_s = 1.0
[[mission.step]]
do = "hover"
time_s = 1.0
[[mission.step]]
do = "go"
distance_m = 1.0
speed_mps = 0.4
"""


@pytest.fixture(scope="module")
def short(vehicle):
    scene = scenario.parse(SHORT, "short")
    return lambda chosen=(): flight.fly(scene, vehicle, 2, 0, effects=chosen)


def as_table(log):
    return np.nan_to_num(np.column_stack([log[c] for c in log.columns]))


def test_the_list_is_the_specification():
    assert set(effects.NAMES) == GAP_LIST
    assert set(effects.EFFECTS) >= GAP_LIST


def test_every_parameter_says_what_it_is():
    for effect in effects.EFFECTS.values():
        assert effect.summary
        assert (effect.settings is None) != (effect.wrench is None)
        assert any(p.neutral is not None for p in effect.parameters), effect.name
        for p in effect.parameters:
            assert p.unit and p.summary and p.low <= p.default <= p.high, (effect.name, p.name)
            assert p.neutral is None or p.low <= p.neutral <= p.high


@pytest.mark.parametrize("name", sorted(GAP_LIST))
def test_strength_goes_to_zero_continuously(short, name):
    effect = effects.get(name)
    nominal = as_table(short())
    off = short({name: effect.scaled(effect.values(), 0.0)})
    np.testing.assert_array_equal(as_table(off), nominal)
    if name == "packet_loss":
        return
    distance = []
    for strength in (1e-4, 1e-2):
        log = short({name: effect.scaled(effect.values(), strength)})
        distance.append(np.max(np.abs(as_table(log) - nominal) / (np.std(nominal, axis=0) + 1e-3)))
    assert 0.0 < distance[0] < 0.5, distance


@pytest.mark.parametrize("name", sorted(n for n in GAP_LIST if effects.get(n).settings))
def test_a_second_one_adds_to_the_first_or_is_refused(vehicle, name):
    effect = effects.get(name)
    twice = [(name, effect.values()), (name, effect.scaled(effect.values(), 0.0))]
    if effect.once:
        with pytest.raises(AirTouchError, match=f"{name} is given twice"):
            effects.activate(twice)
        return
    plants = [stepper.prepare(vehicle, effects.activate(chosen))[0] for chosen in (twice, twice[:1], twice[::-1])]
    assert plants[0] == plants[1] == plants[2], "one that does nothing changes nothing"


def test_two_delays_of_the_optical_flow_add_up(vehicle):
    plant, _ = stepper.prepare(vehicle, effects.activate([("flow_latency", {"delay": d}) for d in (0.02, 0.015)]))
    assert plant[0]["flow_delay"] == pytest.approx(0.035)


def test_order_given_does_not_matter(short):
    chosen = [("mass", {"fraction": 0.1}), ("wind", {"x": 0.2}), ("gust", {})]
    np.testing.assert_array_equal(as_table(short(chosen)), as_table(short(chosen[::-1])))


def test_switching_an_effect_on_leaves_other_draws_alone(short):
    with_noise = as_table(short({"imu_noise": {"factor": 1.0}}))
    np.testing.assert_array_equal(with_noise, as_table(short()))


@pytest.mark.parametrize(("text", "message"), [
    ("thunder:x=1", "no effect 'thunder'"),
    ("wind:x=0.3", "needs the unit m/s"),
    ("wind:x=0.3km/h", "needs the unit m/s"),
    ("wind:q=0.3m/s", "no parameter 'q'"),
    ("wind:x=99m/s", "out of bounds"),
    ("weak_motor:thrust_loss=0.1kg", "needs no unit"),
    ("weak_motor:rotor=2.5", "whole number"),
    ("wind:x", "parameter=value"),
    ("wind:x=1m/s,x=2m/s", "x is given twice"),
    ("ground_effect:preset=crazyflie-34g,preset=frame-67g", "preset is given twice"),
])
def test_bad_effects_get_one_clear_line(text, message):
    with pytest.raises(AirTouchError, match=message) as error:
        effects.parse(text)
    assert "\n" not in str(error.value)


def test_an_effect_on_the_command_line_is_its_name_and_values():
    assert effects.parse("wind:x=0.3m/s, y=-1 m/s")[1] == {"x": 0.3, "y": -1.0, "z": 0.0, "drag": 0.0147,
                                                             "lever": 0.0}
    assert effects.parse("weak_motor:rotor=2,thrust_loss=0.1") == ("weak_motor", {"rotor": 2.0,
            "thrust_loss": 0.1})
    assert effects.parse("mass") == ("mass", {"fraction": 0.1})


OWN = '''
"""A made-up effect: a magnet in the floor that pulls with the square of closeness."""
from airtouch.simulation import signals as at
from airtouch.simulation.effects import Effect, Parameter, wrench


@wrench
def pull(p, s, memory, generator, out):
    out[2] -= p[0] / (1.0 + (s[at.HEIGHT] / p[1]) ** 2)


EFFECT = Effect(
    "made_up_pull", "a magnet in the floor",
    (Parameter("force", "N", 0.01, 0.0, 0.1, 0.0, "at the floor"),
     Parameter("reach", "m", 0.2, 0.01, 1.0, None, "height at which half is left")),
    wrench=pull)
'''


def test_an_effect_of_your_own_is_one_short_file(tmp_path, short, vehicle, signals):
    assert len(OWN.splitlines()) < 60
    path = tmp_path / "made_up_pull.py"
    path.write_text(OWN)
    (effect,) = effects.load_file(path)
    try:
        pulled, nominal = short({"made_up_pull": {"force": 0.02}}), short()
        extra_thrust = vehicle.thrust(pulled.stack([f"m{i}_pwm" for i in range(1, 5)])).sum(1) - vehicle.thrust(
            nominal.stack([f"m{i}_pwm" for i in range(1, 5)])).sum(1)
        assert extra_thrust[150:].mean() > 0.001
        signals[:, at.HEIGHT] = 0.2
        force = replay.wrench_of(effects.activate({"made_up_pull": {"force": 0.02}})[0], signals)
        np.testing.assert_allclose(force[:, 2], -0.01)
    finally:
        effects.unregister("made_up_pull")
    assert effect.name not in effects.EFFECTS


def test_the_docs_table_is_not_stale():
    from pathlib import Path

    from airtouch.simulation.effects.table import updated
    page = (Path(__file__).parents[3] / "host" / "docs" / "effects.md").read_text(encoding="utf-8")
    assert page == updated(page), "run: python -m airtouch.simulation.effects.table host/docs/effects.md"


def test_too_many_parameters_are_told_with_the_limit():
    p = effects.Parameter("size", "1", 0.0, 0.0, 1.0, 0.0, "")
    effects.Effect("many", "", (p,) * 12)
    with pytest.raises(AirTouchError, match="many: 13 parameters; 12 at most"):
        effects.Effect("many", "", (p,) * 13)


@pytest.mark.parametrize("second", ["wind", "first_of_two"])
def test_a_taken_name_leaves_no_effect_of_the_file_registered(tmp_path, second):
    file = tmp_path / "magnet.py"
    file.write_text("from airtouch.simulation.effects import Effect\n"
                    f'a = Effect("first_of_two", "", ())\nb = Effect("{second}", "", ())\n')
    with pytest.raises(AirTouchError, match=f"magnet.py: .*{second}.*another name"):
        effects.load_file(file)
    assert "first_of_two" not in effects.EFFECTS
