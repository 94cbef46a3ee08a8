"""Which command an answer belongs to: it names only the kind, and comes as often as its command arrived."""

from airtouch.crazyflie import mission
from airtouch.crazyflie.autopilot import LATE_S, RESEND_S, Autopilot

ROUTE = (mission.Leg("go", 1.0, 0, 0.5, 0.4), mission.Leg("go", 2.0, 0, 0.5, 3.0), mission.Leg("go", 0.0, 0, 0.5, 3.0))
EACH = 0.01  #: s between two steps


def sent(pilot, begin_s, end_s):
    """The ends (x) of the legs that are sent in this time."""
    steps = range(round(begin_s / EACH), round(end_s / EACH))
    return [c.x_m for i in steps for c in pilot.step(i * EACH, i * EACH)]


def test_the_second_answer_to_a_repeated_leg_is_not_that_to_the_next():
    pilot = Autopilot(ROUTE)
    assert sent(pilot, 0.0, RESEND_S + 0.05) == [1.0, 1.0]  # the first answer is slow
    pilot.answer("go", 0)
    assert sent(pilot, 0.35, 0.75) == [2.0]  # it is lost on the way to the drone
    pilot.answer("go", 0)  # to the repeated first leg
    assert pilot.waiting
    assert sent(pilot, 0.75, 1.1) == [2.0]
    pilot.answer("go", 0)
    assert not pilot.waiting and sent(pilot, 1.1, 3.9) == []
    assert sent(pilot, 3.9, 4.2) == [0.0]


def test_a_lost_answer_costs_no_more_than_one_repetition():
    pilot = Autopilot(ROUTE)
    assert sent(pilot, 0.0, 0.35) == [1.0, 1.0]
    pilot.answer("go", 0)  # the other one is lost
    assert sent(pilot, 0.35, 0.75) == [2.0]
    pilot.answer("go", 0)
    assert sent(pilot, 0.75, 1.1) == [2.0]
    pilot.answer("go", 0)
    assert not pilot.waiting
    assert sent(pilot, 1.1, 4.1) == [0.0]
    pilot.answer("go", 0)
    assert not pilot.waiting, "what was lost more than a second ago is forgotten"
    assert LATE_S < ROUTE[1].seconds
