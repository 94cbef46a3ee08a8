"""What monitor reads of the app, against the app's own sources."""

import re
from pathlib import Path

import pytest

from airtouch.crazyflie.connection import app_log, blocks
from airtouch.kernels.app_core import HEALTH

APP = Path(__file__).parents[3] / "firmware" / "app"


def test_names_and_types_are_those_of_the_log_group():
    source = (APP / "src" / "airtouch_app.c").read_text()
    assert f"LOG_GROUP_START({app_log.GROUP})" in source
    variables = set(re.findall(r"LOG_ADD(?:_BY_FUNCTION)?\(LOG_\w+, (\w+),", source))
    assert {name.split(".")[1] for name in app_log.WANTED.names} <= variables
    assert app_log.WANTED.size <= blocks.MOST_BYTES


def test_health_flags_are_those_of_the_header():
    flags = re.findall(r"APP_\w+ =\s+(\d+),\s*///<", re.search(r"0 is good\. \*/\ntypedef enum \{(.*?)\}",
                                                            (APP / "core" / "app_core.h").read_text(), re.DOTALL)[1])
    assert sorted(app_log.HEALTH) == sorted(HEALTH.values()) == sorted(int(flag) for flag in flags)


def test_a_packet_in_words():
    values = {name: 0 for name in app_log.WANTED.names}
    values |= {"airtouch.prob": 0.75, "airtouch.edges": 3, "airtouch.edge": 2, "airtouch.edgeStep": 950,
               "airtouch.steps": 1000,
               "airtouch.health": 2 | 64, "airtouch.timeouts": 7, "airtouch.detector": 2, "airtouch.load": 90}
    state = app_log.state(values)
    assert (state.probability, state.edges, state.kind) == (0.75, 3, "exit")
    assert (state.detector, state.load_us) == ("best on the GAP8", 90)
    assert state.age_s == pytest.approx(0.5)
    assert state.faults == ("the GAP8 does not answer (7 timeouts)", "the CPX queue was full")


def test_firmware_without_the_app_has_no_block():
    assert app_log.block({"acc.x", "airtouch.edges"}) is None
    assert app_log.block(set(app_log.WANTED.names) - {"airtouch.lost"}).size == app_log.WANTED.size - 2
