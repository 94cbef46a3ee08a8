"""A landing that the drone refuses, or does not answer, while it says that it flies."""

import threading

import pytest
from fake_craft import FakeCraft
from test_flight import fly, kinds


class Refusing(FakeCraft):
    """Refuses to land, with this code, until this time."""

    def __init__(self, code, until_s=1e9):
        super().__init__()
        self.code, self.until_s = code, until_s

    def _plan(self, command):
        return self.code if command.kind == "land" and self.now < self.until_s else super()._plan(command)


class Deaf(FakeCraft):
    """Hears nothing between two times; its packets come."""

    def __init__(self, from_s, until_s=1e9):
        super().__init__()
        self.from_s, self.until_s = from_s, until_s

    def send(self, commands):
        if not self.from_s <= self.now < self.until_s:
            super().send(commands)


def stop_at(craft, seconds, stop):
    return lambda _: stop.set() if craft.now > seconds else None


@pytest.mark.parametrize("stop_s", [9.5, 1e9])
@pytest.mark.parametrize("make", [lambda: Refusing(16), lambda: Refusing(22), lambda: Deaf(9.0)])
def test_motors_are_not_stopped_where_no_landing_is_accepted(tmp_path, make, stop_s):
    """A refused or unanswered landing counted as flown: the motors were cut at 0.8 m, and the guard was disarmed."""
    craft, calls, stop = make(), [], threading.Event()
    flight, _, ended = fly(craft, tmp_path, stop, stop_at(craft, stop_s, stop), in_air=calls.append)
    assert "stop" not in kinds(craft) and craft.flying and not craft.crashed
    assert not flight.landed and calls[-1] is True and ended.endswith("for 60 s, land by hand")
    if stop_s < 1e9:
        assert craft.now == pytest.approx(stop_s + 60.0, abs=0.5)


@pytest.mark.parametrize("stop_s", [9.5, 1e9])
@pytest.mark.parametrize("make", [lambda: Refusing(16, 40.0), lambda: Refusing(22, 40.0), lambda: Deaf(9.0, 40.0)])
def test_a_landing_is_asked_for_until_it_is_accepted(tmp_path, make, stop_s):
    craft, calls, stop = make(), [], threading.Event()
    flight, _, _ = fly(craft, tmp_path, stop, stop_at(craft, stop_s, stop), in_air=calls.append)
    assert not craft.flying and not craft.crashed and craft.at[2] == pytest.approx(0.0)
    assert flight.landed and calls[-1] is False and kinds(craft)[-1] == "stop"


@pytest.mark.parametrize("code", [16, 22])
def test_after_an_error_a_refused_landing_is_left_to_the_guard(tmp_path, code):
    craft, calls = Refusing(code), []

    def show(flight):
        if craft.now > 9.0:
            raise RuntimeError("a bug")

    with pytest.raises(RuntimeError, match="a bug"):
        fly(craft, tmp_path, show=show, in_air=calls.append)
    assert craft.flying and not craft.crashed and calls[-1] is True


def test_the_drone_says_that_it_flies_for_a_while_after_its_motors_stopped(tmp_path):
    """As the firmware does, for 2 s; a landing whose answer was lost is not repeated then: it would spin the motors."""
    class Craft(FakeCraft):
        def _packet(self, index):
            super()._packet(index)
            self.flew_s = self.now if self.state != "idle" else getattr(self, "flew_s", -9.0)

        @property
        def flying(self):
            return self.now - getattr(self, "flew_s", -9.0) < 2.0

        def send(self, commands):
            super().send(commands)
            if self.heard and self.heard[-1][1].kind == "land":
                while not self.answers.empty():
                    self.answers.get()

    craft = Craft()
    _, _, ended = fly(craft, tmp_path)
    landed = [t for t, c in craft.heard if c.kind == "land"]
    assert ended == "as planned" and not craft.crashed and landed[-1] - landed[0] < 2.7
    assert kinds(craft)[-1] == "stop"
