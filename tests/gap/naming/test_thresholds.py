"""What a further effect must gain: in which cells it is held against the effects before it, and beside made ones."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from airtouch.gap.evidence.cells import CELLS, COMMAND_VIEW, REPLAY_VIEW, REST_VIEW, cell_numbers
from airtouch.gap.naming import thresholds
from airtouch.gap.naming.policy import LEAST_GAIN
from airtouch.gap.naming.records import Hypothesis
from airtouch.gap.signals.channels import CHANNELS
from airtouch.gap.signatures.candidates import terms
from hovers import DOWN, hover, scattered, select_from

FORCE_X, FORCE_Z, TORQUE_X, RATE_Y = (
    [c.name for c in CHANNELS].index(name) for name in ("force_x", "force_z", "torque_x", "rate_y"))
#: (view, band, channel) of a gain of the effects before, and of another in the same sensor, band and view
SAME_SENSOR = [
    ((REPLAY_VIEW, 0, FORCE_X), (REPLAY_VIEW, 0, FORCE_Z)),
    ((REPLAY_VIEW, 5, TORQUE_X + 1), (REPLAY_VIEW, 5, TORQUE_X)),
    ((REST_VIEW, 3, RATE_Y), (REST_VIEW, 3, RATE_Y + 1)),
    ((COMMAND_VIEW, 2, 9), (COMMAND_VIEW, 2, 11)),
]
#: the same in another sensor, band or view
ELSEWHERE = [
    ((REPLAY_VIEW, 1, FORCE_Z), (REPLAY_VIEW, 1, TORQUE_X)),
    ((REPLAY_VIEW, 1, TORQUE_X + 2), (REPLAY_VIEW, 1, RATE_Y)),
    ((REPLAY_VIEW, 1, FORCE_X), (REPLAY_VIEW, 2, FORCE_X)),
    ((REPLAY_VIEW, 1, 12), (REPLAY_VIEW, 2, FORCE_X)),
    ((REPLAY_VIEW, 1, FORCE_X), (REST_VIEW, 1, FORCE_X)),
    ((REST_VIEW, 4, RATE_Y), (COMMAND_VIEW, 4, RATE_Y)),
    ((REPLAY_VIEW, 1, 12), (REPLAY_VIEW, 1, 11)),  # the yaw command is no axis of those before it
]


WEAK = {t.values["rotor"]: t for t in terms("weak_motor")}  #: a term for each rotor


def gains(*cells):
    """Gains (CELLS,) of so many nats in cells (view, band, channel), and 0 in the others."""
    out = np.zeros(CELLS)
    for place, nats in cells:
        out[cell_numbers(*place)] += nats
    return out


@pytest.mark.parametrize(("held", "further"), SAME_SENSOR)
def test_axes_of_a_sensor_count_as_one_cell(held, further):
    assert thresholds.gain_in_improved_cells(gains((held, 50.0)), gains((held, 50.0), (further, 20.0))) == 50.0


@pytest.mark.parametrize(("held", "further"), ELSEWHERE)
def test_other_sensor_band_or_view_does_not_count(held, further):
    assert thresholds.gain_in_improved_cells(gains((held, 50.0)), gains((held, 50.0), (further, 20.0))) == 0.0


def test_cell_counts_from_one_nat():
    x, z, other = (REPLAY_VIEW, 0, FORCE_X), (REPLAY_VIEW, 0, FORCE_Z), (REPLAY_VIEW, 0, TORQUE_X)
    held = gains((x, 50.0), (z, -8.0), (other, -30.0))
    assert thresholds.gain_in_improved_cells(held, held + gains((x, 3.0), (z, -1.9), (other, 5.0))) == 42.0
    assert thresholds.gain_in_improved_cells(held, held + gains((x, 3.0), (z, -2.0), (other, 5.0))) == 0.0


def trial(recorded=False):
    """What a hypothesis is judged on, without flights."""
    return SimpleNamespace(data=None, policy=SimpleNamespace(misfit_by_cell=not recorded))


def fitted(gain, full=True):
    return Hypothesis("mass", (), gain, fits=(SimpleNamespace(), SimpleNamespace()), full=full)


@pytest.fixture
def cells(monkeypatch):
    """Gains by cell: 3000 nats of the effects before in one cell, where a further one gains 30, and 7000 in another."""
    here, there = (REPLAY_VIEW, 0, FORCE_X), (REPLAY_VIEW, 0, TORQUE_X)
    held = gains((here, 3000.0), (there, 7000.0))
    more = held + gains((here, 30.0))
    monkeypatch.setattr(thresholds, "held_out_cell_gains", lambda on, j: held if j.gain == 10_000.0 else more)


def test_misfit_by_cell(cells):
    held, more = fitted(10_000.0), fitted(10_030.0)
    assert thresholds.misfit(trial(), held, more, 0.01) == pytest.approx(30.0)
    assert thresholds.misfit(trial(), held, more, 0.0001) == LEAST_GAIN


@pytest.mark.parametrize(("recorded", "everywhere", "full", "gain"), [
    (True, False, True, 10_030.0), (False, True, True, 10_030.0), (False, False, False, 10_030.0),
    (False, False, True, 10_100.0)])
def test_misfit_of_the_whole_gain(cells, recorded, everywhere, full, gain):
    """Recorded flights, a random effect, one that was not fitted, or one that gains as much as the whole share."""
    more = fitted(gain, full)
    assert thresholds.misfit(trial(recorded), fitted(10_000.0), more, 0.01, everywhere) == pytest.approx(100.0)


@pytest.mark.parametrize(("rotors", "share"), [((1,), 0.01), ((1, 2), 0.25)])
def test_a_second_of_a_name_is_a_further_effect_of_its_own(rotors, share):
    """Two weak rotors have one name. Beside an effect of the loop, another that changed it would need a quarter."""
    def hypothesis(gain, of_rotors):
        return Hypothesis("weak_motor", tuple(WEAK[r] for r in of_rotors), gain, full=False)

    judged = changing_the_loop(misfit_by_cell=False, loop_misfit_by_cell=False)
    least = thresholds.least_further_gain(judged, hypothesis(10_000.0, (1,)), hypothesis(10_050.0, rotors))
    assert least == pytest.approx(share * 10_000.0)


def changing_the_loop(**policy):
    """A trial in which every effect changes the loop, with a policy."""
    study = SimpleNamespace(loop=SimpleNamespace(changes_loop=lambda active: True))
    return SimpleNamespace(data=SimpleNamespace(study=study),
                           policy=SimpleNamespace(misfit_share=0.01, loop_misfit_share=0.25, **policy))


@pytest.mark.parametrize(("by_cell", "against"), [(True, 3000.0), (False, 10_000.0)])
def test_what_a_fitted_loop_is_wrong_by_shows_everywhere(cells, by_cell, against):
    """An effect that changes the loop beside another one: held against the cell that it improves, or all."""
    base = replace(fitted(10_000.0), terms=(WEAK[1],))
    extended = replace(fitted(10_030.0), terms=(WEAK[1], WEAK[2]))
    judged = changing_the_loop(misfit_by_cell=True, loop_misfit_by_cell=by_cell)
    assert thresholds.least_further_gain(judged, base, extended) == pytest.approx(0.25 * against)


def added_gains(selection):
    """What each step gains over those before it, by name."""
    so_far = [0.0, *(s.gain for s in selection.steps)]
    return {s.name: s.gain - before for s, before in zip(selection.steps, so_far, strict=False)}


def test_misfit_share_of_recorded_flights():
    """A push, and noise a tenth above the floor: enough beside models that are exact, and not beside those of air."""
    flights, names = [hover(2, (0.0, 0.0, -DOWN), louder=1.1)], ("mass", "imu_noise")
    exact, _ = select_from(flights, names, scattered(exact=True))
    assert [(s.name, s.is_named) for s in exact.steps] == [("mass", True), ("imu_noise", True)]
    factor = exact.named_hypothesis.terms[1].values["factor"]
    assert factor == pytest.approx(np.sqrt(2.0 * 1.1 ** 2 - 1.0), rel=0.03), "over the declared noise, half the floor"
    added = added_gains(exact)
    assert LEAST_GAIN < added["imu_noise"] < 0.1 * added["mass"]
    recorded, _ = select_from(flights, names, scattered())
    assert [s.name for s in recorded.steps] == ["mass"]
    assert recorded.single_effects["imu_noise"].gain > LEAST_GAIN, "alone it would do"


def test_misfit_counts_in_improved_cells_of_simulated_flights():
    """Twice the noise everywhere, and a faint push that shows in the lowest band alone."""
    flights, names = [hover(2, (0.0, 0.0, -0.06), louder=2.0)], ("mass", "imu_noise")
    exact, _ = select_from(flights, names, scattered(exact=True))
    assert [(s.name, s.is_named) for s in exact.steps] == [("imu_noise", True), ("mass", True)]
    added = added_gains(exact)
    assert LEAST_GAIN < added["mass"] < 0.01 * added["imu_noise"]
    recorded, _ = select_from(flights, names, scattered())
    assert [s.name for s in recorded.steps] == ["imu_noise"]


def test_lost_rows_add_no_misfit():
    """Of a tenth that another effect must gain in recorded flights, lost rows count for nothing."""
    lost = np.random.default_rng(0).random(3000) < 0.1
    flight = replace(hover(2, (0.0, 0.0, -0.1), louder=1.25), lost=lost)
    names_reported, names = [], ("mass", "imu_noise", "packet_loss")
    selection, _ = select_from([flight], names, scattered(), progress=names_reported.append)
    assert [s.name for s in selection.steps] == ["packet_loss", "mass", "imu_noise"]
    added = added_gains(selection)
    assert 0.1 * added["mass"] < added["imu_noise"] < 0.1 * (added["mass"] + added["packet_loss"])
    assert names_reported.count("imu_noise") >= 3, "told in every round"


@pytest.mark.parametrize(("louder", "named"), [(1.2, False), (1.25, True)])
def test_random_effect_is_named_from_a_quarter_of_the_gain(louder, named):
    """A model that is wrong looks random: noise that gains less stands there without a name."""
    selection, _ = select_from([hover(2, (0.0, 0.0, -DOWN), louder=louder)], ("mass", "imu_noise"), scattered())
    added = added_gains(selection)
    assert [(s.name, s.is_named) for s in selection.steps] == [("mass", True), ("imu_noise", named)]
    assert (added["imu_noise"] > 0.25 * added["mass"]) == named and added["imu_noise"] > 0.1 * added["mass"]


def test_few_lost_rows_are_not_named():
    """What the log did to its own times has no cells in which it is held against the effect before it."""
    lost = np.zeros(3000, bool)
    lost[500:2900:200] = True
    selection, data = select_from([replace(hover(2, (0.0, 0.0, -DOWN)), lost=lost)], ("mass", "packet_loss"),
                                  scattered(exact=True))
    assert 0.0 < selection.single_effects["packet_loss"].gain < LEAST_GAIN
    assert [s.name for s in selection.steps] == ["mass"]


def test_faint_push_beside_lost_rows_is_not_named():
    lost = np.random.default_rng(0).random(3000) < 0.1
    flight = replace(hover(2, (0.0, 0.0, -0.02)), lost=lost)
    selection, _ = select_from([flight], ("mass", "packet_loss"), scattered(exact=True))
    assert 0.0 < selection.single_effects["mass"].gain < LEAST_GAIN
    assert [s.name for s in selection.steps] == ["packet_loss"]
