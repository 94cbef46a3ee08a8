"""The firmware's side of the link: passes each packet to its service, and sends log and console packets."""

import struct

from airtouch.sitl.app import GROUP
from airtouch.sitl.drone import Drone
from airtouch.sitl.services import memory_service, variables
from airtouch.sitl.services import packet as crtp
from airtouch.sitl.services.log_service import LogService
from airtouch.sitl.services.packet import Packet
from airtouch.sitl.services.param_service import ParamService
from airtouch.sitl.services.variables import INITIAL, RESET_ESTIMATE, START_OVER

PROTOCOL = 12
VERSION, DEVICE = b"2026.08 virtual", b"CF21"
GREETING = b"Bitcraze Crazyflie"
BITFIELD, ARM, RECOVER, EMERGENCY, WATCHDOG = 0x0C, 1, 2, 3, 4
RESPONSE = 0x80
WATCHDOG_S = 1.0  #: s, timeout of the emergency-stop watchdog once a client has started it


class Firmware:
    """The firmware. `take` answers a packet. `tick` flies 10 ms and returns log and console packets."""

    def __init__(self, drone: Drone, ai_deck: bool = True) -> None:
        self.drone = drone
        table = variables.log_variables(drone)
        items = variables.log_items(table)
        self.log = LogService(items, variables.reader(table, items, drone))
        self.param = ParamService(variables.parameters(drone, ai_deck), self._changed)
        self.printed: list[str] = []  #: console lines of the last tick
        self._fed_s: float | None = None

    def say(self, text: str) -> None:
        """Print on the console."""
        self.drone.messages.append(text)

    def tick(self) -> list[Packet]:
        """Fly 10 ms. Returns the console and log packets of this time."""
        if self._fed_s is not None and self.drone.now_s - self._fed_s > WATCHDOG_S:
            self._fed_s = None
            self.drone.stop()
        self.drone.step()
        self.printed, self.drone.messages = self.drone.messages, []
        text = "".join(line + "\n" for line in self.printed).encode()
        pieces = (text[i:i + crtp.MOST_DATA] for i in range(0, len(text), crtp.MOST_DATA))
        console = [Packet(crtp.CONSOLE, 0, piece) for piece in pieces]
        return console + self.log.due(self.drone.now_ms)

    def take(self, packet: Packet) -> list[Packet]:
        """The answers to a packet. Packets to unknown ports, and too short ones, are ignored."""
        port, channel, data = packet
        drone = self.drone
        if port == crtp.LOG:
            return self.log.take(packet, drone.now_ms)
        if port == crtp.PARAM:
            return self.param.take(packet)
        if port == crtp.MEMORY:
            return memory_service.take(packet)
        if port == crtp.COMMANDER and channel == 0:
            drone.commander.take_rpyt(data, drone.now_s, drone.estimate)
        elif port == crtp.GENERIC and channel == 0:
            drone.commander.take_generic(data, drone.now_s, drone.estimate)
        elif port == crtp.GENERIC and channel == 1 and data[:1] == b"\0":
            drone.commander.relax()
        elif port == crtp.LOCALIZATION and channel == 1:
            self._stop_command({3: EMERGENCY, 4: WATCHDOG}.get(data[0] if data else -1))
        elif port == crtp.HIGH_LEVEL:
            code = drone.commander.planner.command(data, drone.now_s)
            return [Packet(port, channel, (data[:3] + b"\0" * 3)[:3] + bytes([code]))]
        elif port == crtp.SUPERVISOR:
            return self._supervisor(channel, data)
        elif port == crtp.PLATFORM:
            return self._platform(channel, data)
        elif port == crtp.LINK:
            return self._link(channel, data)
        return []

    def _link(self, channel: int, data: bytes) -> list[Packet]:
        if channel == 0:
            return [Packet(crtp.LINK, 0, data)]
        if channel == 1:
            return [Packet(crtp.LINK, 1, GREETING.ljust(crtp.MOST_DATA, b"\0"))]
        return [Packet(crtp.LINK, 3, b"")] if channel == 3 else []

    def _platform(self, channel: int, data: bytes) -> list[Packet]:
        if not data:
            return []
        if channel == 1:
            answers = {0: struct.pack("<I", PROTOCOL), 1: VERSION, 2: DEVICE}
            return [Packet(crtp.PLATFORM, 1, data[:1] + answers[data[0]])] if data[0] in answers else []
        if channel == 0 and data[0] in (ARM, RECOVER):
            return [Packet(crtp.PLATFORM, 0, data[:1] + self._request(data[0]))]
        return []

    def _supervisor(self, channel: int, data: bytes) -> list[Packet]:
        if not data:
            return []
        command, answer = data[0], None
        if channel == 0 and command == BITFIELD:
            answer = struct.pack("<H", self.drone.info())
        elif channel == 0 and 1 <= command <= 11:
            answer = bytes([self.drone.info() >> (command - 1) & 1])
        elif channel == 1 and command in (ARM, RECOVER):
            answer = self._request(command)
        elif channel == 1:
            self._stop_command(command)
        if answer is None:
            return []
        return [Packet(crtp.SUPERVISOR, channel, bytes([command | RESPONSE]) + answer)]

    def _stop_command(self, command: int | None) -> None:
        if command == EMERGENCY:
            self.drone.stop()
        elif command == WATCHDOG:
            self._fed_s = self.drone.now_s

    def _request(self, command: int) -> bytes:
        """The answer to a supervisor command. The virtual drone arms itself, so arming succeeds if it can fly."""
        ready = self.drone.recover() if command == RECOVER else bool(self.drone.info() & 1)
        return bytes([ready, ready])

    def _changed(self, name: str, value: float) -> dict[str, float]:
        group, _, parameter = name.partition(".")
        drone, planner = self.drone, self.drone.commander.planner
        if group == GROUP:
            drone.app.set(parameter, value)
            return drone.app.values()
        if name == START_OVER and value:
            drone.start_over()
        elif name == RESET_ESTIMATE and value:
            drone.reset_estimate(*(self.param.values[initial] for initial in INITIAL))
            return {name: 0}
        elif name == "stabilizer.stop" and value:
            drone.stop()
        elif name == "hlCommander.vtoff":
            planner.takeoff_mps = value if value > 0.0 else planner.takeoff_mps
        elif name == "hlCommander.vland":
            planner.landing_mps = value if value > 0.0 else planner.landing_mps
        elif name == "hlCommander.groupmask":
            planner.group = int(value)
        elif name == "flightmode.althold":
            drone.commander.alt_hold = bool(value)
        elif name == "flightmode.poshold":
            drone.commander.pos_hold = bool(value)
        return {}
