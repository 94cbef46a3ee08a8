"""What keeps a drone on the ground, each in one line with its remedy."""

from unittest.mock import Mock

import pytest

from airtouch.crazyflie import checks
from airtouch.crazyflie.checks import Condition
from airtouch.crazyflie.connection.drone import Drone
from airtouch.errors import AirTouchError

GOOD = Condition(4.0, {"bcFlow2": True, "bcMultiranger": True, "bcAI": True}, 0b11111, 0.02)


def test_a_good_drone_may_fly():
    assert checks.problems(GOOD) == [] and checks.notes(GOOD) == []


@pytest.mark.parametrize("condition, message", [
    (Condition(3.5, GOOD.decks), "battery at 3.50 V, less than 3.70 V; charge it"),
    (Condition(float("nan"), GOOD.decks), "battery at nan V"),
    (Condition(4.0, {"bcFlow2": False}), "no Flow deck found .*attach it and restart"),
    (Condition(4.0, {}), "no Flow deck"),
    (Condition(4.0, GOOD.decks, 1 << 5), "is tumbled; put it upright"),
    (Condition(4.0, GOOD.decks, 1 << 6), "is locked"),
    (Condition(4.0, GOOD.decks, 1 << 7), "has crashed"),
    (Condition(4.0, GOOD.decks, None, 1.7), "reads 1.70 m on the ground"),
    (Condition(4.0, GOOD.decks, None, float("nan")), "reads nan m"),
])
def test_each_fault_is_one_line(condition, message):
    import re

    (line,) = checks.problems(condition)
    assert re.search(message, line) and "\n" not in line


def test_optional_decks_are_only_noted():
    no_options = Condition(4.0, {"bcFlow2": True})
    assert checks.problems(no_options) == []
    (note,) = checks.notes(no_options)
    assert "Multi-ranger" in note and checks.notes(GOOD) == []


@pytest.mark.parametrize("text, ctype, value",
                         [("255", "uint8_t", 255), ("0x10", "uint8_t", 16), ("-128", "int8_t", -128),
                                                ("1.5", "float", 1.5), ("1e-6", "float", pytest.approx(1e-6))])
def test_values_that_a_parameter_can_hold(text, ctype, value):
    assert checks.representable("g.n", text, ctype) == value


@pytest.mark.parametrize("text, ctype, message", [
    ("256", "uint8_t", "out of range; the drone keeps it as uint8_t, 0 to 255"), ("-1", "uint16_t", "out of range"),
    ("1.5", "uint8_t", "give a whole number"), ("yes", "float", "give a number"), ("1e40", "float", "out of range"),
    ("nan", "float", "give a finite number"), ("-inf", "float", "give a finite number"),
])
def test_values_that_it_cannot(text, ctype, message):
    with pytest.raises(AirTouchError, match=message):
        checks.representable("g.n", text, ctype)


def test_a_parameter_that_the_drone_keeps_as_no_number_was_not_set():
    drone, updates = Drone.__new__(Drone), []
    drone.crazyflie = Mock()
    drone.crazyflie.param.toc.get_element.return_value.ctype = "float"
    drone.crazyflie.param.values = {"g": {"n": "0.5"}}
    drone.crazyflie.param.add_update_callback = lambda group, name, update: updates.append(update)
    drone.crazyflie.param.set_value = lambda name, value: updates[0](name, str(value))
    drone.crazyflie.param.request_param_update = lambda name: updates[0](name, "nan")
    with pytest.raises(AirTouchError, match="g.n = 0.7: out of range; the drone kept nan"):
        drone.set_parameter("g.n", "0.7")


@pytest.mark.parametrize("text", ["airtouch.enable", "enable=1", "a.b.c=1", "a.b="])
def test_settings_are_written_in_one_way(text):
    with pytest.raises(AirTouchError, match="group.name=value"):
        checks.parse_setting(text)


def test_a_setting_in_its_parts():
    assert checks.parse_setting("airtouch.pFa=1e-5") == ("airtouch.pFa", "1e-5")
