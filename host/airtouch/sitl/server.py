"""The virtual Crazyflie on a UDP port, in real time or faster, with injected faults and one client at a time.

The client that sent to the log port last gets the log data.
"""

import contextlib
import errno
import math
import select
import socket
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np

from airtouch import __version__
from airtouch import vehicle as vehicles
from airtouch.errors import AirTouchError
from airtouch.simulation import scenario as scenarios
from airtouch.simulation.flight import Chosen, choose, metadata
from airtouch.sitl.commander import PERIOD_S
from airtouch.sitl.drone import Drone
from airtouch.sitl.faults import LINE, Fault, Line, parse
from airtouch.sitl.firmware import Firmware
from airtouch.sitl.recorder import Recorder
from airtouch.sitl.services import packet as crtp
from airtouch.vehicle import Vehicle

HOST, PORT = "127.0.0.1", 19850  #: address at which cflib searches for virtual drones
GREETING = f"SYS: virtual Crazyflie, AirTouch {__version__}"
MOST_BEHIND_S = 0.5  #: s behind real time, beyond which the drone's clock is delayed; no sample is skipped
MOST_AT_ONCE = 200  #: datagrams read between two rows
LINK_TIMEOUT_S = 1.0  #: s without a link after which the firmware deletes its log blocks


class Server:
    """The virtual Crazyflie. `run` serves until `stop`; clients connect to `uri`.

    scenario (or mission), vehicle: names, files or objects. effects, without: as in `airtouch simulate`. The drone
    stands at the start of the scenario's mission. speed: multiple of real time. faults: texts or
    `Fault`s. record: file of the flight log, written at the end.
    Raises AirTouchError for settings that cannot be flown, a port in use and a `record` that exists.
    """

    def __init__(self, scenario: scenarios.Scenario | str | Path = "paper-9cm", *, port: int = PORT,
                 host: str = HOST, speed: float = 1.0, faults: Sequence[Fault | str] = (),
                 vehicle: Vehicle | str | Path | None = None, effects: Chosen = (),
                 without: Sequence[str] = (), seed: int = 0, flight: int = 0, ai_deck: bool = True,
                 record: Path | None = None, force: bool = False) -> None:
        if not 0.0 < speed <= 100.0:
            raise AirTouchError("speed must be above 0 and at most 100")
        scene = scenario if isinstance(scenario, scenarios.Scenario) else scenarios.load(scenario)
        craft = vehicle if isinstance(vehicle, Vehicle) else vehicles.load(vehicle or vehicles.DEFAULT_VEHICLE)
        ordered = [fault if isinstance(fault, Fault) else parse(fault) for fault in faults]
        self.plan = scenarios.draw_flight(scene, seed, flight)
        active = choose(self.plan, effects, without)
        self.drone = Drone(self.plan, craft, seed, flight, active, ai_deck)
        self.firmware = Firmware(self.drone, ai_deck)
        meta = metadata(self.plan, craft, seed, flight, active, scene.name)
        # the speed is its client's, not the one that was drawn for the scenario's mission
        meta["condition"] = {name: value for name, value in self.plan.values.items() if name != "speed"}
        self.recorder = Recorder(record, meta, force) if record else None
        self.speed = speed
        self.client: crtp.Peer | None = None
        rng = np.random.default_rng([seed, flight, 11])
        self._up, self._down = Line((), rng), Line((), rng)
        self.faults: list[Fault] = []
        self._todo: list[Fault] = []
        for fault in ordered:
            self.order(fault)
        self._cut_until_s = -math.inf
        self._stop = threading.Event()
        self._socket = _bind(host, port)
        self.port = self._socket.getsockname()[1]
        self.uri = f"udp://{host}:{self.port}"
        self.slept_s = 0.0  #: s by which the drone's clock was delayed because the computer was too slow

    def order(self, fault: Fault | str) -> None:
        """Add a fault while the server runs."""
        fault = fault if isinstance(fault, Fault) else parse(fault)
        self.faults.append(fault)
        if fault.kind in LINE:
            self._up.add(fault)
            self._down.add(fault)
            self._record(fault)
        else:
            self._todo.append(fault)

    def stop(self) -> None:
        """End `run`. May be called from any thread."""
        self._stop.set()

    def close(self) -> None:
        """Close the port. `run` does so at its end."""
        self._socket.close()

    def run(self, say: Callable[[str], None] = lambda _: None) -> None:
        """Serve until `stop`. say: called with each line of the drone's console."""
        start = time.monotonic() - self.drone.now_s / self.speed
        try:
            while not self._stop.is_set():
                now = time.monotonic()
                due = start + (self.drone.ticks + 1) * PERIOD_S / self.speed
                if now < due:
                    if select.select([self._socket], [], [], due - now)[0]:
                        self._receive()
                    self._exchange((time.monotonic() - start) * self.speed)
                    continue
                behind = (now - due) * self.speed - MOST_BEHIND_S
                if behind > 0.0:
                    start += behind / self.speed
                    self.slept_s += behind
                self._receive()
                self.step(say)
        finally:
            self.close()
            if self.recorder:
                self.recorder.write()

    def step(self, say: Callable[[str], None]) -> None:
        """One step of PERIOD_S: packets from the client, faults that begin, the firmware, packets to the client.

        say: is given what the firmware printed, line by line.
        """
        drone = self.drone
        self._exchange(drone.now_s)
        self._begin_faults(drone.now_s)
        for packet in self.firmware.tick():
            if self.client:
                self._down.put(packet, self.client, drone.now_s)
        for line in self.firmware.printed:
            say(line)
        if self.recorder:
            self.recorder.add(drone.row)
        self._exchange(drone.now_s)

    def _begin_faults(self, now_s: float) -> None:
        drone = self.drone
        for fault in list(self._todo):
            since = drone.took_off_s
            if fault.at_s > -math.inf and (since is None or now_s < since + fault.at_s):
                continue
            self._todo.remove(fault)
            self._record(fault)
            if fault.kind == "disconnect":
                self._cut_until_s = now_s + fault.amount
                self._up.clear()
                self._down.clear()
                if fault.amount > LINK_TIMEOUT_S:
                    self.firmware.log.reset()
            elif fault.kind == "gap8-reset":
                drone.app.reset_gap8(now_s)
            elif fault.kind == "gap8-silent":
                drone.app.gap8_silent = True
            else:
                drone.drain()

    def _record(self, fault: Fault) -> None:
        """Name a fault that begins now in the recording."""
        if self.recorder:
            self.recorder.add_fault(fault, self.drone.now_s)

    def _receive(self) -> None:
        """Put all received datagrams onto the simulated link."""
        for _ in range(MOST_AT_ONCE):  # a flood of datagrams must not stop the flight
            try:
                datagram, peer = self._socket.recvfrom(2048)
            except BlockingIOError:
                return
            except OSError:  # the client is gone
                continue
            packet = crtp.parse(datagram)
            if packet is not None and self.drone.now_s >= self._cut_until_s:
                self._up.put(packet, peer, self.drone.now_s)

    def _exchange(self, now_s: float) -> None:
        """Handle the packets that have arrived, and send the packets that are due."""
        for packet, peer in self._up.ready(now_s):
            takes_over = self.client is None or packet.port == crtp.LOG
            if peer != self.client and takes_over and not crtp.is_null(packet):
                self._welcome(peer)
            for answer in self.answers(packet):
                self._down.put(answer, peer, now_s)
        for packet, peer in self._down.ready(now_s):
            if now_s >= self._cut_until_s:
                self.send(packet, peer)

    def answers(self, packet: crtp.Packet) -> list[crtp.Packet]:
        """The firmware's answers to a packet."""
        return self.firmware.take(packet)

    def send(self, packet: crtp.Packet, peer: crtp.Peer) -> None:
        """Send a packet. A client that is gone is no error."""
        with contextlib.suppress(OSError):
            self._socket.sendto(packet.to_bytes(), peer)

    def _welcome(self, peer: crtp.Peer) -> None:
        """Send log data and console to a new client. A drone on the ground is restarted."""
        self.client = peer
        if not self.drone.motors_on:
            self.drone.restart()
        self.firmware.say(GREETING)


def _bind(host: str, port: int) -> socket.socket:
    udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    udp.setblocking(False)
    try:
        udp.bind((host, port))
    except (OSError, OverflowError) as error:
        udp.close()
        if isinstance(error, OSError) and error.errno == errno.EADDRINUSE:
            raise AirTouchError(f"port {port} of {host} is in use, perhaps by another `airtouch sitl`: end that one, "
                                "or choose another port with --port") from None
        raise AirTouchError(f"port {port} of {host}: {error}; choose another with --port") from None
    return udp


@contextlib.contextmanager
def serve(scenario: scenarios.Scenario | str | Path = "paper-9cm", **settings) -> Iterator[Server]:
    """Run a virtual Crazyflie in a thread: `with serve(port=0) as virtual: connect(virtual.uri)`.

    Takes the arguments of `Server` and raises its errors. An error of the thread, as of a recording that cannot be
    written, is raised at the end.
    """
    server = Server(scenario, **settings)
    errors: list[Exception] = []

    def run() -> None:
        try:
            server.run()
        except Exception as error:
            errors.append(error)

    thread = threading.Thread(target=run, name="virtual-crazyflie", daemon=True)
    thread.start()
    try:
        yield server
    finally:
        server.stop()
        thread.join()
        if errors:
            raise errors[0]
