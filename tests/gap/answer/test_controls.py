"""What the answer is compared with: a wrong effect, which closes nothing, and the vehicle as declared."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from airtouch.gap.answer.controls import arms_of, control_of
from airtouch.gap.answer.shrink import gap_of
from airtouch.gap.signatures.signature import WRONG
from hovers import DOWN, FLOOR, hover, select_from


@pytest.fixture(scope="module")
def pushed():
    """A hover that is pushed down, whose mass is named: data, selection and gap."""
    selection, data = select_from([hover(1, (0.0, 0.0, -DOWN))], ("mass",))
    return data, selection, gap_of(data, selection.halves, selection.named_hypothesis)


def test_a_wrong_effect_closes_nothing(pushed):
    data, selection, gap = pushed
    wrong = control_of(data, selection, gap)
    assert wrong.name == WRONG[0] and wrong.closure.before == gap.closure.before
    assert abs(wrong.closure.shrink.value) < 0.05 < 0.8 < gap.closure.shrink.value


def test_neither_the_answer_nor_another_name_of_it_is_wrong(pushed, monkeypatch):
    data, selection, gap = pushed
    monkeypatch.setattr("airtouch.gap.answer.controls.WRONG", ("thrust_coefficient", "mass", "com_offset"))
    assert control_of(data, selection, gap).name == "com_offset"
    monkeypatch.setattr("airtouch.gap.answer.controls.WRONG", ("thrust_coefficient", "mass"))
    assert control_of(data, selection, gap) is None


def test_another_name_of_the_answer_is_not_wrong_where_a_rival_is_as_good(pushed, monkeypatch):
    data, selection, gap = pushed
    named = selection.single_effects["mass"]
    gained = {"mass": named.gain, "wind": named.gain - 1.0, "thrust_coefficient": named.gain - 20.0}
    rivals = {n: replace(named, name=n, gain=gain) for n, gain in gained.items()}
    of = replace(selection, single_effects=rivals, least_nats=dict.fromkeys(rivals, 8.0))
    monkeypatch.setattr("airtouch.gap.answer.controls.WRONG", ("thrust_coefficient", "com_offset"))
    assert control_of(data, of, gap).name == "com_offset"


def test_the_gap_is_also_closed_with_the_vehicle_as_declared(pushed):
    """With the same study it closes as much; with none the answer's own is the only one."""
    data, selection, gap = pushed
    answer = SimpleNamespace(gap={"before": gap.closure.before, "after": gap.closure.after}, shrink=gap.closure.shrink)
    assert arms_of(None, data.flights, selection, answer) == {"declared": gap.closure}
    both = arms_of(FLOOR, data.flights, selection, answer)
    assert both["calibrated"] == gap.closure
    assert both["declared"].shrink.value == pytest.approx(gap.closure.shrink.value, abs=0.02)


def test_a_jitter_is_measured_in_the_logged_times_with_either_vehicle():
    """A vehicle changes no times: both runs have the same gap. No wrong effect has one in them."""
    late = 0.004 * np.random.default_rng(4).normal(size=3000)
    selection, data = select_from([replace(hover(2), clock_s=late)], ("time_jitter", "mass"))
    gap = gap_of(data, selection.halves, selection.named_hypothesis)
    assert [s.name for s in selection.named_steps] == ["time_jitter"] and gap.closure.before > 2.0
    answer = SimpleNamespace(gap={"before": gap.closure.before, "after": gap.closure.after}, shrink=gap.closure.shrink)
    both = arms_of(FLOOR, data.flights, selection, answer)
    assert both["declared"] == both["calibrated"] == gap.closure
    assert control_of(data, selection, gap) is None
