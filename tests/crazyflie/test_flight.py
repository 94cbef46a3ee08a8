"""Whole flights with a fake craft: what goes wrong in the air ends on the ground, with the data kept."""

import errno
import os
import threading

import numpy as np
import pytest
from fake_craft import FakeCraft

from airtouch import logs
from airtouch.crazyflie import mission
from airtouch.crazyflie.autopilot import Autopilot
from airtouch.crazyflie.connection import blocks
from airtouch.crazyflie.connection.intake import Intake
from airtouch.crazyflie.flight import Flight
from airtouch.crazyflie.recorder import Recorder

HEIGHT = 0.8
LEGS = (mission.Leg("wait", 0, 0, 0, 1.0), mission.Leg("take-off", 0, 0, HEIGHT, 2.0),
        mission.Leg("hover", 0, 0, HEIGHT, 3.0), mission.Leg("go", 3.0, 0, HEIGHT, 10.0),
        mission.Leg("hover", 3.0, 0, HEIGHT, 1.0), mission.Leg("land", 3.0, 0, 0, 2.7),
        mission.Leg("wait", 3.0, 0, 0, 0.5))


def fly(craft, folder, stop=None, show=lambda _: None, legs=LEGS, **more):
    intake = Intake(blocks.STATE)
    book = Recorder(folder / "f_0001.csv.gz", intake.names, {"mission": "test", "acc_frame": "body"})
    flight = Flight(craft, Autopilot(legs), intake, book, stop or threading.Event(), show=show, clock=craft.clock,
                    sleep=craft.sleep, **more)
    ended = flight.run()
    return flight, book, ended


def kinds(craft):
    return [c.kind for _, c in craft.heard]


def test_a_mission_flies_as_planned_and_the_log_shows_its_edges(tmp_path):
    craft = FakeCraft()
    flight, book, ended = fly(craft, tmp_path)
    log = book.finish(ended=ended)
    assert ended == "as planned" and flight.landed and not craft.flying and not craft.crashed
    assert [k for k in dict.fromkeys(kinds(craft))] == ["take-off", "go", "land", "stop"]
    flight_log = logs.read(tmp_path / "f_0001.csv.gz")
    assert not list(tmp_path.glob("*.part"))
    assert [e.kind for e in logs.true_edges(flight_log)] == ["entry", "exit"]
    assert flight_log.meta["lost_samples"] == 0 and flight_log.meta["ended"] == "as planned"
    assert np.allclose(np.diff(flight_log["t_s"]), 0.01)
    entry, leave = logs.true_edges(flight_log)
    distance = 0.3 * 0.01 * (leave.sample - entry.sample)
    assert distance == pytest.approx(1.0, abs=0.02)
    assert flight_log["x_m"][entry.sample] == pytest.approx(1.0, abs=0.03)
    assert len(log) == len(flight_log)


def test_thirty_percent_loss_is_counted_and_every_command_gets_through(tmp_path):
    craft = FakeCraft(loss=0.3)
    flight, book, ended = fly(craft, tmp_path)
    log = book.finish()
    assert ended == "as planned" and not craft.flying and not craft.crashed
    span = round((log["t_s"][-1] - log["t_s"][0]) / 0.01) + 1
    assert len(log) + log.meta["lost_samples"] == span
    assert 0.25 < log.meta["lost_samples"] / span < 0.35
    assert [e.kind for e in logs.true_edges(log)] == ["entry", "exit"]
    assert np.diff(log["t_s"]).max() > 0.015  # gaps stay gaps


def test_a_five_second_drop_in_mid_sweep_ends_on_the_ground(tmp_path):
    craft = FakeCraft(silent=[(9.0, 14.0)])
    flight, book, ended = fly(craft, tmp_path)
    log = book.finish(ended=ended)
    assert ended == "link lost for 3.0 s" and not craft.flying and not craft.crashed
    assert flight.silences == [pytest.approx(5.0, abs=0.1)]
    assert log.meta["longest_gap_s"] == pytest.approx(5.0, abs=0.05)
    assert log.meta["lost_samples"] == pytest.approx(499, abs=2)
    assert log["t_s"][-1] > 15.0 and log["t_s"][0] < 0.1  # both sides of the drop are there
    assert next(t for t, c in craft.heard if c.kind == "land") == pytest.approx(14.0, abs=0.4)


def test_a_short_drop_is_flown_through(tmp_path):
    craft = FakeCraft(silent=[(8.0, 10.5)])
    flight, book, ended = fly(craft, tmp_path)
    assert ended == "as planned" and not craft.flying
    assert book.log().meta["longest_gap_s"] == pytest.approx(2.5, abs=0.05)


def test_a_drop_at_the_end_of_a_leg_delays_the_next(tmp_path):
    craft = FakeCraft(silent=[(5.5, 7.5)])  # the "go" of 6 s gets lost
    _, _, ended = fly(craft, tmp_path)
    went = [t for t, c in craft.heard if c.kind == "go"]
    assert ended == "as planned" and 7.5 <= went[0] < 8.0 and not craft.crashed
    landed = next(t for t, c in craft.heard if c.kind == "land")
    assert landed - went[0] == pytest.approx(11.0, abs=0.5)  # the whole leg at its own speed, then a second of hover


@pytest.mark.parametrize("until_s", [14.0, 15.0, 16.5, 20.0, 25.0, 60.0])
def test_however_long_the_silence_the_drone_lands_when_it_is_heard_again(tmp_path, until_s):
    craft = FakeCraft(silent=[(9.0, until_s)])
    _, _, ended = fly(craft, tmp_path)
    assert ended == "link lost for 3.0 s" and not craft.flying and not craft.crashed
    assert kinds(craft)[2:4] == ["land", "stop"]
    assert next(t for t, c in craft.heard if c.kind == "land") == pytest.approx(until_s, abs=0.4)


def test_a_command_that_fell_into_a_silence_is_sent_when_it_is_over(tmp_path):
    craft = FakeCraft(silent=[(5.9, 8.8)])  # the "go" of 6 s; at most 8 tries of 0.3 s would count as accepted
    _, _, ended = fly(craft, tmp_path)
    went = [t for t, c in craft.heard if c.kind == "go"]
    assert ended == "as planned" and len(went) == 1 and 8.8 <= went[0] < 9.2 and not craft.crashed


def test_a_drone_that_never_comes_back_is_given_up_after_a_minute(tmp_path):
    craft = FakeCraft(silent=[(9.0, 1e9)])
    flight, _, ended = fly(craft, tmp_path)
    assert ended == "link lost for 3.0 s; NO CONTACT for 60 s, land by hand" and not flight.landed
    assert craft.clock() == pytest.approx(9.0 + 3.0 + 60.0, abs=0.5)


def test_a_drone_that_falls_silent_after_a_refusal_is_given_up_after_a_minute(tmp_path):
    """It waited for ever, also after Ctrl-C."""
    class Craft(FakeCraft):
        def _plan(self, command):
            if command.kind == "go":
                self.silent = [(self.now + 0.001, 1e9)]  # after its answer
                return 16
            return super()._plan(command)

    def show(flight):
        if craft.now > 120.0:
            raise RuntimeError("it goes on for ever")

    craft = Craft()
    flight, _, ended = fly(craft, tmp_path, show=show)
    assert "refuses go" in ended and ended.endswith("NO CONTACT for 60 s, land by hand") and not flight.landed
    assert craft.now == pytest.approx(6.0 + 60.0, abs=1.0)


@pytest.mark.parametrize("dead_link", [False, True])
def test_a_drone_that_restarted_in_a_silence_gets_no_command_before_it_is_heard(tmp_path, dead_link):
    craft = FakeCraft(restart_at=12.0, silent=[(9.0, 12.5)], unheard=[(12.5, 14.0)], uptime_s=60,
                      dead_link_at=12.6 if dead_link else None)
    _, _, ended = fly(craft, tmp_path)
    assert ended == "the drone restarted in flight" and not craft.crashed
    assert kinds(craft) == ["take-off", "go"]


def test_a_broken_link_is_opened_again_to_land(tmp_path):
    craft = FakeCraft(dead_link_at=9.0)
    flight, book, ended = fly(craft, tmp_path)
    assert craft.reopened == 1 and "link lost" in ended and not craft.flying and not craft.crashed


@pytest.mark.parametrize("after_s", [0.5, 2.0, 5.0, 9.0, 17.0])
def test_a_request_to_stop_lands_whenever_it_comes(tmp_path, after_s):
    stop = threading.Event()
    craft = FakeCraft()

    def show(flight):
        if flight.intake.newest_ms and flight.intake.newest_ms > 1000 * after_s:
            stop.set()

    flight, book, ended = fly(craft, tmp_path, stop, show)
    assert ended == "stopped by the user" and not craft.flying and not craft.crashed and flight.landed
    assert ("take-off" in kinds(craft)) == (after_s > 1.0)
    assert len(book.finish()) > 20


def test_a_full_disk_lands_and_keeps_what_was_written(tmp_path, monkeypatch):
    craft, real, bytes_written = FakeCraft(), os.write, [0]

    def write(handle, data):
        bytes_written[0] += len(data)
        if bytes_written[0] > 60_000:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return real(handle, data)

    monkeypatch.setattr("airtouch.crazyflie.recorder.os.write", write)
    flight, book, ended = fly(craft, tmp_path)
    assert "No space left" in ended and not craft.flying and not craft.crashed
    partial = logs.read(tmp_path / "f_0001.csv.gz.part")
    assert 100 < len(partial) < len(book.log())
    assert not any("cut off" in w for w in partial.meta["warnings"])
    monkeypatch.undo()
    assert len(book.finish()) == len(book.log()) and not list(tmp_path.glob("*.part"))


def test_a_low_battery_lands(tmp_path):
    craft = FakeCraft(volts=3.3)
    _, _, ended = fly(craft, tmp_path)
    assert "battery at 3.0" in ended and not craft.flying


def test_a_refusing_supervisor_stays_on_the_ground(tmp_path):
    craft = FakeCraft(busy=True)
    flight, _, ended = fly(craft, tmp_path)
    assert "supervisor refuses take-off" in ended and flight.pilot.refused and "land" not in kinds(craft)


@pytest.mark.parametrize("uptime_h", [0, 1, 3, 4.5])
def test_a_drone_that_restarts_in_flight_ends_it(tmp_path, uptime_h):
    craft = FakeCraft(restart_at=9.0, uptime_s=int(3600 * uptime_h))
    _, book, ended = fly(craft, tmp_path)
    assert ended == "the drone restarted in flight" and len(book.finish()) > 500
    assert "land" not in kinds(craft)


@pytest.mark.parametrize("restart_at", [4.0, 9.0, 17.0])
def test_a_drone_that_flies_on_while_its_clock_jumps_is_landed(tmp_path, restart_at):
    craft, calls = FakeCraft(restart_at=restart_at, falls=False), []
    flight, book, ended = fly(craft, tmp_path, in_air=calls.append)
    assert ended == "the drone's clock jumped" and not craft.flying and not craft.crashed and flight.landed
    assert [k for k in kinds(craft) if k != "go"][1:3] == ["land", "stop"]
    assert calls[-1] is False and book.finish()["t_s"][-1] == pytest.approx(restart_at, abs=0.02)


@pytest.mark.parametrize("falls", [True, False])
def test_a_drone_that_does_not_say_whether_it_flies_is_left_to_the_guard(tmp_path, falls):
    craft, calls = FakeCraft(restart_at=9.0, falls=falls, mute=True), []
    flight, _, ended = fly(craft, tmp_path, in_air=calls.append)
    assert "land it by hand" in ended and "land" not in kinds(craft) and calls[-1] is True and not flight.landed


def test_an_error_of_ours_lands_first(tmp_path):
    craft = FakeCraft()

    def show(flight):
        if flight.pilot.phase == "mission" and flight.pilot.leg and flight.pilot.leg.kind == "go":
            raise RuntimeError("a bug")

    with pytest.raises(RuntimeError, match="a bug"):
        fly(craft, tmp_path, show=show)
    assert not craft.flying and not craft.crashed
    assert len(logs.read(tmp_path / "f_0001.csv.gz.part")) > 300  # readable though nobody finished it


@pytest.mark.parametrize(("height", "least_s"), [(0.3, 2.0), (2.5, 2.5 / 0.3)])
def test_after_an_error_it_lands_as_slowly_as_a_mission(tmp_path, height, least_s):
    def show(flight):
        if flight.pilot.leg and flight.pilot.leg.kind == "hover":
            raise RuntimeError("a bug")

    craft, legs = FakeCraft(), (mission.Leg("take-off", 0, 0, height, 3.0), mission.Leg("hover", 0, 0, height, 3.0))
    with pytest.raises(RuntimeError, match="a bug"):
        fly(craft, tmp_path, legs=legs, show=show)
    (landed_s, land), (stopped_s, _) = craft.heard[-2:]
    assert land.kind == "land" and land.seconds == pytest.approx(least_s)
    assert stopped_s - landed_s > least_s and not craft.crashed


def test_an_error_after_the_landing_sends_no_land_command(tmp_path, monkeypatch):
    def tail(flight):
        raise RuntimeError("a bug")

    monkeypatch.setattr(Flight, "_tail", tail)
    craft = FakeCraft()
    with pytest.raises(RuntimeError, match="a bug"):
        fly(craft, tmp_path, legs=LEGS[:-1])  # as missions end: with the landing
    assert kinds(craft)[-2:] == ["land", "stop"] and not craft.flying


@pytest.mark.parametrize("craft", [FakeCraft(), FakeCraft(volts=3.3), FakeCraft(restart_at=9.0)],
                         ids=["planned", "early", "restarted"])
def test_the_guard_is_told_of_the_air_alone(tmp_path, craft):
    calls = []
    fly(craft, tmp_path, in_air=lambda flying: calls.append((flying, len(craft.heard))))
    assert calls[0] == (False, 0) and (True, 0) in calls  # before the take-off is sent
    assert calls[-1][0] is False and craft.heard[calls[-1][1] - 1][1].kind in ("stop", "go")


def test_a_closed_terminal_is_no_reason_to_fall(tmp_path):
    def gone(*_):
        raise BrokenPipeError

    craft = FakeCraft(silent=[(8.0, 12.0)])
    _, _, ended = fly(craft, tmp_path, show=gone, say=gone)
    assert "link lost" in ended and not craft.flying and not craft.crashed
