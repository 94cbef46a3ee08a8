"""The flow deck and the AI-deck of the emulated board: against closed forms and the protocol's own frames."""


import numpy as np
import pytest

from airtouch import vehicle as vehicles
from airtouch.kernels.app_core import AppCore
from airtouch.simulation.scenario import draw_flight
from tools.firmware_emulation import gap8, missions
from tools.firmware_emulation.deck import CLEAR, Deck, Faults, frame
from tools.firmware_emulation.plant import FLOW, Plant


def counts_of_flow(x, distance, top):
    """Forward counts of the optical flow, sum of 0.2 s at 0.3 m/s, so far above what lies below x."""
    plan = draw_flight(missions.mission(missions.CASES[0]), 1, 0)
    plant = Plant(plan, vehicles.load("crazyflie-2.1-flow"), 1, 0, [])
    drone = plant.stepper.plant[0]
    drone["flow_noise"] = 0.0
    total = 0.0
    for _ in range(300):
        state = plant.state["body"]["state"]
        state[:3] = x, 0.0, top + distance + float(drone["range_below_rotors"])
        state[3:6], state[6:10], state[10:13] = (0.3, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), 0.0
        plant.step(np.full(4, 40_000.0))
        total += plant.readings[FLOW]
    return total


def test_the_emulated_flow_sees_the_distance_to_what_is_below():
    """Not the height over the floor: the real firmware divides by its own height, and corrects nothing."""
    floor, platform = counts_of_flow(0.0, 0.2, 0.0), counts_of_flow(0.95, 0.2, 0.76)
    assert platform == pytest.approx(floor, rel=0.05) and floor > 0.0
    assert counts_of_flow(0.0, 0.4, 0.0) == pytest.approx(0.5 * floor, rel=0.05)
    assert counts_of_flow(0.95, 0.04, 0.76) == pytest.approx(2.5 * floor, rel=0.05), "0.08 m is the nearest in focus"


class Wire:
    """A board that only records what it receives."""

    def __init__(self):
        self.said, self.handlers = [], {}

    def on(self, kind, handler):
        self.handlers[kind] = handler

    def say(self, kind, content=b""):
        self.said.append(content)

    def go(self):
        pass


def test_the_deck_frames_takes_turns_and_answers():
    """CPX over UART: 0xff, length, route, data and the exclusive or of all; a frame only after the other's ff 00."""
    core = AppCore({"detector": gap8.DETECTOR}, have_gap8=True)
    core.step([0.0, 0.0, 9.8], [0.0, 0.0, 0.0], [40_000.0] * 4)
    reset, = core.packets()
    packet_bytes = bytes([0xFF, len(reset) + 2, 4 | 1 << 3 | 1 << 6, 5]) + reset
    xor = 0
    for byte in packet_bytes:
        xor ^= byte
    wire = Wire()
    deck = Deck(wire)
    deck.turn(0)
    wire.handlers["U"](packet_bytes[:5])
    assert wire.said == []
    wire.handlers["U"](packet_bytes[5:] + bytes([xor]))
    assert deck.sent == [reset] and wire.said == [CLEAR], "it may go on; the answer waits for its turn"
    wire.handlers["U"](CLEAR)
    reply, = deck.step_packets()
    assert wire.said[-1] == frame(reply) and frame(reply)[2:4] == bytes([1 | 4 << 3 | 1 << 6, 5])
    core.receive(reply)
    core.step([0.0, 0.0, 9.8], [0.0, 0.0, 0.0], [40_000.0] * 4)
    assert core.log.link == 1, "filling: the GAP8 has taken the reset"


def test_a_deck_that_is_not_there_and_a_packet_for_the_wifi():
    wire = Wire()
    deck = Deck(wire, Faults(there=False))
    wire.handlers["U"](CLEAR)
    assert wire.said == []
    deck = Deck(wire)
    wire.handlers["U"](frame(b"name")[:2] + bytes([2 | 1 << 3 | 1 << 6, 4]) + b"name" + b"\0")
    assert deck.sent == [] and wire.said == [CLEAR]
