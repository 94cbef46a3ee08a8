"""Any TOML gives a scenario, or a vehicle, or an AirTouchError in one line."""

import copy

import pytest
import tomli_w
from hypothesis import example, given, settings
from hypothesis import strategies as st

from airtouch import vehicle as vehicles
from airtouch.errors import AirTouchError
from airtouch.simulation import scenario

WHOLE = {
    "name": "whole", "firmware": "2026.08", "range_module": "map",
    "values": {"cruise": {"low": 0.7, "high": 0.8}, "speed": 0.3, "kind": {"choice": ["cement", "grass"]}},
    "world": {"floor": "cement", "room_m": [-3.0, 3.0, -3.0, 3.0]},
    "platform": [{"shape": "rectangle", "size_m": [0.5, 0.5], "centre_m": [2.0, 0.0], "angle_deg": 10.0, "top_m": 0.2},
                 {"shape": "circle", "radius_m": 0.3, "centre_m": [0.0, 2.0], "top_m": 0.1, "material": "grass"},
                 {"shape": "polygon", "corners_m": [[2.0, 2.0], [2.5, 2.0], [2.0, 2.5]], "top_m": "= cruise / 4"}],
    "effects": {"wind": {"x": 0.1}, "battery_sag": {"charge": 0.9},
                "weak_motor": [{"rotor": 1, "thrust_loss": 0.01}, {"rotor": 2, "thrust_loss": 0.02}]},
    "vehicle": {"mass_kg": 0.033, "arm_m": 0.04, "flow_noise_mps": [0.1, 0.1]},
    "mission": {"start_m": [0.0, 0.0], "yaw_deg": 0.0, "control": "velocity", "step": [
        {"do": "wait", "time_s": 0.5}, {"do": "take-off", "height_m": "= cruise", "time_s": 1.0},
        {"do": "hover", "time_s": 0.5, "pulse_mps": 0.1, "every_s": 0.2},
        {"do": "go", "distance_m": 0.3, "direction_deg": 0.0, "height_m": 0.6, "speed_mps": "= speed"},
        {"do": "go", "to_m": [0.0, 0.0], "speed_mps": 0.3},
        {"do": "zigzag", "size_m": [0.5, 0.3], "spacing_m": 0.2, "speed_mps": 0.4}, {"do": "land", "time_s": 1.0}]}}
CRAFT = {"name": "mine", "mass_kg": 0.03, "arm_m": 0.04, "inertia_kg_m2": [1.6e-5, 1.6e-5, 2.9e-5],
         "thrust_of_pwm_n": [0.0, 1e-6, 2e-11], "yaw_torque_over_thrust_m": 0.006, "motor_time_constant_s": 0.06,
         "rotor_radius_m": 0.023, "firmware": "2026.08", "flow_noise_mps": [0.1, 0.1], "battery_cells": 1}
LEAVES = st.one_of(st.sampled_from([0, -1, 3, 1e-300, 1e308, 10**300, "", "= speed", "= kind", "= 1 / 0",
                                    "= " + "-" * 3000 + "1",
                                    float("nan"), float("inf"), True]), st.floats(), st.text(max_size=5), st.dates())
NODES = st.recursive(LEAVES, lambda inner: st.one_of(
    st.lists(inner, max_size=4),
    st.dictionaries(st.sampled_from(["low", "high", "choice", "do", "x", "preset", "step"]), inner, max_size=3)),
    max_leaves=5)


def places(node, path=()):
    """The path of every value in nested tables and lists."""
    if path:
        yield path
    inner = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for key, value in inner:
        yield from places(value, (*path, key))


def put(table, path, node):
    """A copy of the table with another value at a place."""
    table = copy.deepcopy(table)
    inner = table
    for key in path[:-1]:
        inner = inner[key]
    inner[path[-1]] = node
    return table


def refusal(parse, text):
    """The message of the AirTouchError that a text gives; None where it gives a result."""
    try:
        parse(text, "mine.toml")
    except AirTouchError as error:
        assert "\n" not in str(error)
        return str(error)
    return None


def test_the_whole_ones_are_right():
    assert refusal(scenario.parse, tomli_w.dumps(WHOLE)) is None
    assert refusal(vehicles.parse, tomli_w.dumps(CRAFT)) is None


@settings(max_examples=500)
@given(path=st.sampled_from(list(places(WHOLE))), node=NODES)
def test_a_scenario_with_any_other_value_is_read_or_refused(path, node):
    refusal(scenario.parse, tomli_w.dumps(put(WHOLE, path, node)))


@settings(max_examples=200)
@given(path=st.sampled_from(list(places(CRAFT))), node=NODES)
def test_a_vehicle_with_any_other_value_is_read_or_refused(path, node):
    refusal(vehicles.parse, tomli_w.dumps(put(CRAFT, path, node)))


@pytest.mark.parametrize("parse", [scenario.parse, vehicles.parse])
@given(text=st.text())
@example(text="a = " + "9" * 5000)
@example(text="a = " + "[" * 5000)
def test_text_that_names_nothing_is_refused(parse, text):
    """A text drawn at random has no mission and no mass."""
    assert refusal(parse, text)


@pytest.mark.parametrize("path, node, key", [
    *((("platform", 0, key), "text", key) for key in ("top_m", "size_m", "angle_deg", "centre_m")),
    (("platform",), {"top_m": 1.0}, "[[platform]]"), (("mission", "step"), 3, "[[mission.step]]"),
    (("mission", "step", 0, "time_s"), "text", "time_s"), (("world", "room_m"), "text", "room_m"),
    (("world", "room_m"), [3.0, -3.0, -3.0, 3.0], "room_m"), (("platform", 1, "radius_m"), -1, "radius_m"),
    (("platform", 1, "radius_m"), 0, "radius_m"), (("effects", "wind", "x"), "text", "wind: x"),
    (("effects",), 3, "[effects]"), (("effects", "wind"), 3, "effects.wind"),
    (("vehicle", "arm_m"), -0.03, "arm_m"),
    (("vehicle", "motor_time_constant_s"), 0, "motor_time_constant_s"),
    (("mission", "step", 5, "spacing_m"), 1e-9, "step 6"), (("mission", "step", 3, "distance_m"), 1e12, "step 4")])
def test_the_refusal_names_the_key(path, node, key):
    assert key in (refusal(scenario.parse, tomli_w.dumps(put(WHOLE, path, node))) or "")


@pytest.mark.parametrize("name", ["", "/", "two\nlines", "nul\0"])
def test_a_name_that_no_file_can_have_is_refused(name):
    assert "name = " in (refusal(scenario.parse, tomli_w.dumps(WHOLE | {"name": name})) or "")


@pytest.mark.parametrize("key, value", [("arm_m", -0.03), ("motor_time_constant_s", 0), ("mass_kg", "text")])
def test_a_vehicle_that_cannot_be_is_refused(key, value):
    assert key in (refusal(vehicles.parse, tomli_w.dumps(CRAFT | {key: value})) or "")


@pytest.mark.parametrize("name", ["x" * 300, "x" * 300 + ".toml", "../models/best", "a\0.toml"])
def test_a_vehicle_that_a_log_names_oddly_is_unknown(name):
    flown, warning = vehicles.of_log({"vehicle": name})
    assert flown == vehicles.load() and "no file is known" in warning


def test_a_log_whose_vehicle_file_is_wrong_is_told_what_is_wrong(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(tomli_w.dumps(CRAFT | {"mas_kg": 0.03}))
    flown, warning = vehicles.of_log({"vehicle": str(path)})
    assert flown == vehicles.load() and "unknown key mas_kg" in warning and "no file is known" not in warning


@pytest.mark.parametrize("table", [{"acc_noise_rms_mps2": -0.1}, {"gyro_noise_ratio": [1, 1, -1]},
                                   {"gyro_bandwidth_hz": -1.0}, {"flow_noise_mps": [0.1, -0.1]}])
def test_negative_noise_is_refused(table):
    with pytest.raises(AirTouchError, match=f"v.toml: {next(iter(table))} = .* must be 0 or more"):
        vehicles.numbers(table, "v.toml")
