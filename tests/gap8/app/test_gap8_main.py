"""The GAP8 app's main.c, run: PMSIS and CPX stand in for the chip, eight threads for the cluster's cores."""

import binascii
import struct
import subprocess
from pathlib import Path

import numpy as np
import pytest

from airtouch.kernels.app_core import DETECTORS, HEALTH, AppCore, Gap8Core
from patience import HANG_S
from sanitized import FLAGS, link

HERE = Path(__file__).parent
ROOT = HERE.parents[2]
APP = ROOT / "gap8" / "app" / "src"
SHARED = [APP / "gap8_core.c", *sorted((ROOT / "firmware" / "link").glob("*.c")),
          ROOT / "firmware/kernels/feature_window.c", *sorted((ROOT / "gap8" / "kernels").glob("*_int8.c")),
          ROOT / "gap8/kernels/fixed_scale.c"]
#: what of the app is written against PMSIS, and what stands in for that
STANDING_IN = [*(p for p in sorted(APP.glob("*.c")) if p.name != "main.c" and p not in SHARED),
               HERE / "pmsis" / "runtime.c"]
STM32, WIFI_HOST, CONSOLE, APP_FUNCTION = 1, 3, 2, 5
HALF_SECOND = struct.pack("<BH", 0, 0)
RESULT, HEARTBEAT = 3, 4


def packet(data: bytes, source: int = STM32, length: int | None = None) -> bytes:
    """A record of the stand-in: a CPX packet that says another length than it has, where one is given."""
    length = len(data) if length is None else length
    return struct.pack("<BH", source, length) + data.ljust(min(length, 1020), b"\xa1")


class Chip:
    """The app in a process of its own."""

    def __init__(self, program: Path, *faults: str):
        self._process = subprocess.Popen([program, *faults], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        assert self._process.stdin is not None and self._process.stdout is not None
        self._in, self._out = self._process.stdin, self._process.stdout
        self.lines: list[str] = []  #: on the console

    def exchange(self, records: list[bytes]) -> list[bytes]:
        """What the app sends in answer to records, and half a second later its heartbeat where it has one."""
        self._in.write(b"".join([*records, HALF_SECOND]))
        self._in.flush()
        packets: list[bytes] = []
        function = -1
        while function != 0:
            head = self._out.read(3)
            assert len(head) == 3, f"the app has ended: {self.close()}"
            function, length = struct.unpack("<BH", head)
            body = self._out.read(length)
            if function == APP_FUNCTION:
                packets.append(body)
            elif function == CONSOLE:
                self.lines.append(body.decode().rstrip())
        return packets

    def close(self) -> int:
        """Ends it: its exit status, 0 unless a sanitizer found something."""
        self._in.close()
        self._out.close()
        return self._process.wait(HANG_S)


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    """The app and its stand-ins, built with sanitizers."""
    own = [*FLAGS, f"-I{HERE / 'pmsis'}"]
    parts = [([*own, "-Dmain=appMain"], [APP / "main.c"]), (own, STANDING_IN), (FLAGS, SHARED)]
    return link(parts, tmp_path_factory.mktemp("main") / "app")


@pytest.fixture
def start(program):
    """Starts the app with the faults that are named; each must end well."""
    chips: list[Chip] = []
    yield lambda *faults: chips.append(Chip(program, *faults)) or chips[-1]
    assert [chip.close() for chip in chips] == [0] * len(chips)


def sample(rng: np.random.Generator) -> tuple:
    return rng.normal(0, 1, 3) + [0, 0, 9.81], rng.normal(0, 0.3, 3), rng.uniform(40_000, 45_000, 4)


def conversation(detector: str, steps: int) -> tuple[list[bytes], list[bytes]]:
    """Packets that the STM32 app sends, and the replies of the GAP8's core alone."""
    stm32, gap8 = AppCore({"detector": DETECTORS.index(detector)}, have_gap8=True), Gap8Core()
    rng, requests, replies = np.random.default_rng(0), [], []
    for _ in range(steps):
        stm32.step(*sample(rng))
        for request in stm32.packets():
            requests.append(request)
            replies.append(gap8.take(request))
            stm32.receive(replies[-1])
    assert stm32.log.answers > 0
    return requests, replies


def reset(session: int) -> bytes:
    """A RESET for a network that no GAP8 has."""
    head = struct.pack("<BBBBIIB8s", 0xA1, 1, 23, session, 0, 7, 1, b"unknown!")
    return head + struct.pack("<H", binascii.crc_hqx(head, 0xFFFF))


@pytest.mark.parametrize("detector, steps", [("best-gap8", 400), ("paper-gap8", 330), ("paper-stream-gap8", 330)])
def test_the_app_replies_what_its_core_replies(start, detector, steps):
    requests, replies = conversation(detector, steps)
    chip = start()
    assert chip.exchange([packet(request) for request in requests])[:-1] == replies
    assert chip.lines[0].startswith("AirTouch: 3 networks, best ")
    assert chip.lines[1:] == ["AirTouch: session 1, model known, cluster 175 MHz"]


def test_packets_of_any_length_and_of_others_are_refused_and_counted(start):
    requests, replies = conversation("best-gap8", 300)
    foreign = [packet(b"", length=n) for n in (0, 1, 9, 10, 98, 99, 100, 1020, 1021, 65_535)]
    foreign += [packet(requests[0], source=WIFI_HOST), packet(requests[0] + b"\0")]
    records = [packet(request) for request in requests]
    *packets, heartbeat = start().exchange(records[:100] + foreign + records[100:])
    assert packets == replies, "as if they had not come"
    assert struct.unpack_from("<I", heartbeat, 8 + 16)[0] == len(foreign)


@pytest.mark.parametrize("fault, words", [("open", "the cluster does not open"), ("task", "the cluster takes no task")])
def test_without_a_cluster_the_stm32_is_told_so_and_computes(start, fault, words):
    chip, rng = start(fault), np.random.default_rng(0)
    stm32 = AppCore({"detector": DETECTORS.index("best-gap8")}, have_gap8=True)
    for _ in range(400):
        stm32.step(*sample(rng))
        for reply in chip.exchange([packet(request) for request in stm32.packets()]):
            stm32.receive(reply)
    assert stm32.log.health == HEALTH["model refused"] | HEALTH["no GAP8"]
    assert DETECTORS[stm32.log.detector] == "best" and stm32.log.answers > 0
    assert f"AirTouch: {words}, the STM32 computes" in chip.lines
    assert "AirTouch: session 1, model refused, cluster 0 MHz" in chip.lines


def test_a_cluster_that_fails_in_flight_repeats_no_reply(start):
    requests, _ = conversation("best-gap8", 300)
    chip = start("later")  # its first task sets up, its second one fails
    packets = chip.exchange([packet(item) for item in requests])
    assert sum("takes no task" in line for line in chip.lines) == 1
    assert len(packets) == len(requests) - 1 + 1 and {item[1] for item in packets[:-1]} == {RESULT}


def test_a_clock_that_is_refused_is_said_and_the_safe_one_stays(start):
    requests, replies = conversation("best-gap8", 300)
    chip = start("clock", "controller")
    assert chip.exchange([packet(request) for request in requests])[:-1] == replies
    assert chip.lines[:2] == ["AirTouch: the controller's clock is refused",
                              "AirTouch: the cluster's clock is refused, it stays at 50 MHz"]
    assert chip.lines[-1] == "AirTouch: session 1, model known, cluster 50 MHz"


def test_not_a_byte_before_the_stm32_has_spoken(start):
    requests, replies = conversation("best-gap8", 300)
    chip = start("open", "clock")
    foreign = [packet(b"noise"), packet(requests[0], source=WIFI_HOST), packet(b"", length=65_535)]
    assert [chip.exchange(records) for records in ([], [], foreign, [])] == [[]] * 4 and chip.lines == []
    reply, heartbeat = chip.exchange([packet(requests[0])])
    assert (reply[1], heartbeat[1]) == (RESULT, HEARTBEAT) and len(chip.lines) == 3
    later = [len(chip.exchange([])) for _ in range(25)]
    assert later == [1] * 19 + [0] * 6 and len(chip.lines) == 3, "ten seconds, then silence"


def test_sessions_do_not_flood_the_console(start):
    chip = start()
    assert len(chip.exchange([packet(reset(1 + i % 255)) for i in range(600)])) == 601
    assert len(chip.lines) == 2, "the start and the last session"
