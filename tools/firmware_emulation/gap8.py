"""The image with the AI-deck's driver: a flight whose network runs on the GAP8, with what may go wrong on the way.

Each step of the app is compared with the desktop's core that gets the same samples and packets, and each packet that
came over the UART with what that core sends.
"""

import struct
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from airtouch import vehicle as vehicles
from airtouch.errors import AirTouchError
from airtouch.kernels.app_core import DETECTORS, EDGES, HEALTH, LINK, AppCore
from airtouch.logs.flight_log import FlightLog
from airtouch.sitl.app import LOGS

from .board import REPLAY, Board
from .deck import Deck, Faults
from .replay import FED, VEHICLE, Replay, compare, desktop_values, rows, sample, stack

#: parameter of the detector whose network is on the GAP8
DETECTOR = DETECTORS.index("best-gap8")
NONCE = slice(8, 12)  #: of the first packet, a RESET (edge_link.h)
#: what goes wrong in each flight
CASES = {
    "a GAP8 that answers": Faults(),
    "answers 8 steps late": Faults(late=8),
    "a tenth of the packets lost": Faults(lost=0.1),
    "a tenth of the packets damaged": Faults(damaged=0.1),
    "a GAP8 without power from step 500 to 800": Faults(dead=(500, 800), reset=799),
    "a GAP8 that never answers": Faults(dead=(0, 1 << 30)),
    "an AI-deck that never answers": Faults(there=False),
}

#: a wrong byte on the UART, which CPX asserts against
WRONG_BYTE = Faults(wrong_byte=100)
#: counters of the log that are printed
COUNTERS = ("answers", "lag", "lost", "dropped", "timeouts", "resets")


@dataclass
class Linked(Replay):
    """A replay, with the packets that came over the UART, those that differ from the desktop's, those
    that were still in queues at the end, and the state of the link by the log."""

    packets: int = 0
    other_packets: int = 0
    kept_packets: int = 0
    link: str = ""
    health: tuple[str, ...] = ()
    counters: dict[str, int] = field(default_factory=dict)


@dataclass
class _Step:
    """What the board had in a step: its row, its log after it, and the packets that it received."""

    row: np.ndarray
    values: dict[str, float]
    packets: list[bytes]


def replay(elf: Path, log: FlightLog, steps: int, faults: Faults) -> Linked:
    """Fly a recorded flight through the emulated firmware with the network on the GAP8."""
    table, board_steps, result = rows(log)[:steps], [], Linked()
    board = Board(elf, REPLAY, [f"airtouch.{name}" for name in LOGS], ai_deck=True)
    deck = Deck(board, faults)
    with board:
        board.ask("W", FED)
        board.parameter("airtouch.detector", DETECTOR)
        board.go()
        for step, row in enumerate(table):
            board.hear("A")
            deck.turn(step)
            board.say("V", row.tobytes())
            board.go()
            values = board.values(board.hear("S"))
            board_steps.append(_Step(row, values, deck.step_packets()))
        board.hear("A")
        free_words = board.end()
    _follow(result, board_steps, deck.sent)
    result.late, result.longest_us = int(values["airtouch.late"]), int(values["airtouch.loadMax"])
    result.console, (result.stack_bytes, result.least_left) = board.console, stack(free_words)
    result.link = LINK[int(values["airtouch.link"])]
    result.health = tuple(name for name, bit in HEALTH.items() if int(values["airtouch.health"]) & bit)
    result.counters = {name: int(values[f"airtouch.{name}"]) for name in COUNTERS}
    return result


def _follow(result: Linked, board_steps: list[_Step], sent: list[bytes]) -> None:
    """Make the same steps on the desktop, and compare them and the packets.

    The board's nonce is in its first packet; that CPX's queue took no packet shows in the next step's `dropped`.
    """
    nonce = struct.unpack("<I", sent[0][NONCE])[0] if sent else 1
    core, expected = AppCore(have_gap8=True, nonce=nonce, vehicle=vehicles.load(VEHICLE)), []
    core.set_params(detector=DETECTOR)
    for i, step in enumerate(board_steps):
        for packet in step.packets:
            core.receive(packet)
        acc, gyro, pwm, volts, attitude = sample(step.row)
        kind = core.step(acc, gyro, pwm, vbat_v=volts, attitude=attitude)
        if kind != EDGES[0]:
            result.edges.append((i, kind))
        compare(result, i, step.values, desktop_values(core))
        after = board_steps[min(i + 1, len(board_steps) - 1)].values
        expected += core.packets(accepted=after["airtouch.dropped"] == step.values["airtouch.dropped"])
    result.packets = len(sent)
    result.other_packets = sum(one != other for one, other in zip(sent, expected, strict=False))
    result.kept_packets = len(expected) - len(sent)


def report(elf: Path, log: FlightLog, steps: int) -> bool:
    """Fly every case, print; whether no step and no packet differed, and the wrong byte was reported."""
    well = True
    for what, faults in CASES.items():
        result = replay(elf, log, steps, faults)
        well = well and not result.different and not result.other_packets
        task, words = result.least_left
        print(f"{what}: {result.steps} steps, {result.different} differ, {result.packets} packets, "
              f"{result.other_packets} differ, {result.kept_packets} still in queues; edges "
              f"{' '.join(f'{kind}@{step}' for step, kind in result.edges) or 'none'}\n  link {result.link}, health: "
              f"{', '.join(result.health) or 'good'}; " + ", ".join(f"{k} {v}" for k, v in result.counters.items())
              + f"\n  late {result.late}, longest step {result.longest_us} us; app's stack {result.stack_bytes} of "
              f"1600 bytes, least left of any task {4 * words} ({task})", flush=True)
        if result.first:
            print(f"  first difference: {result.first}")
    try:
        replay(elf, log, steps, WRONG_BYTE)
    except AirTouchError as error:
        print(f"a byte of the UART that CPX's own checksum refuses: {error}")
    else:
        print("a byte of the UART that CPX's own checksum refuses: nothing happened")
        well = False
    return well
