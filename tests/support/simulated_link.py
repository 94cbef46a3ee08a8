"""cflib on the virtual drone in one process, without radio, socket or wall clock.

`simulated(...)` serves the drone at URI. Its time is the only time: it passes while our own code sleeps, and a
sleep ends when cflib's threads have dealt with all that came meanwhile. So a busy machine changes nothing. The
modules named in CLOCKED see the drone's clock as `time`, and cflib's timers go off by it.
"""

import contextlib
import heapq
import itertools
import queue
import threading
import time
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

from cflib.crtp.crtpdriver import CRTPDriver
from cflib.crtp.crtpstack import CRTPPacket
from cflib.crtp.exceptions import WrongUriType

from airtouch.sitl import Server
from airtouch.sitl.faults import Fault, Line
from airtouch.sitl.services.packet import LOG, PARAM, Packet
from patience import HANG_S

URI = "simulated://"
CLOCKED = [f"airtouch.crazyflie.{name}" for name in (
    "readiness", "connection.drone", "flight", "connection.log_blocks", "connection.ticks", "monitor")]
CLOCKED += ["cflib.crazyflie.link_statistics", "cflib.positioning.motion_commander"]
LOOK_S = 0.0002
CREATE, APPEND, SETTINGS = 6, 7, 1


class Clock:
    """In the place of the module `time`. `sleep` lets the drone's time pass where the test's thread calls it.

    Another thread that sleeps waits until that much has passed; nothing passes while such a thread works.
    """

    def __init__(self, drone: "SimulatedDrone") -> None:
        self._drone, self._mine = drone, threading.current_thread()
        self._now, self._order = drone.drone.now_s, itertools.count()
        self._due: list[tuple[float, int, Callable[[], None]]] = []
        self._asleep: dict[threading.Thread, threading.Event] = {}
        self._sleepers: set[threading.Thread] = set()

    def monotonic(self) -> float:
        """The drone's time, s."""
        return self._now

    time = monotonic

    def clock_gettime(self, clock: int) -> float:
        """The drone's time, s, whichever clock of the system is asked for."""
        return self.monotonic()

    def at(self, due_s: float, action: Callable[[], None]) -> None:
        """Call `action` when it is that late."""
        heapq.heappush(self._due, (due_s, next(self._order), action))

    def sleep(self, seconds: float) -> None:
        """Let so much time pass."""
        if threading.current_thread() is not self._mine:
            self.wait(self.fall_asleep(seconds))
            return
        self.settle()
        end = self._now + seconds
        while True:
            tick_s = self._drone.drone.now_s + 0.01
            first = min(tick_s, self._due[0][0] if self._due else tick_s)
            if first > end + 1e-9:
                break
            self._now = max(first, self._now)
            if first < tick_s:
                heapq.heappop(self._due)[2]()
            else:
                self._drone.tick()
            self.settle()
        self._now = end

    def wait_for(self, condition: Callable[[], object], seconds: float = 60.0) -> object:
        """Let time pass until condition() holds; its value. Fails after so many seconds of the drone's."""
        end = self._now + seconds
        while not (value := condition()):
            assert self._now < end, "it did not happen"
            self.sleep(0.01)
        return value

    def settle(self) -> None:
        """Wait until cflib's threads and ours have nothing left to do now."""
        end = time.monotonic() + HANG_S
        while self._drone.busy() or any(t not in self._asleep for t in threading.enumerate()
                                        if t in self._sleepers or t.name == "airtouch-revive"):
            assert time.monotonic() < end, "a thread never comes to rest"
            time.sleep(LOOK_S)

    def fall_asleep(self, seconds: float) -> threading.Event:
        """The event of this thread's alarm, set after so many seconds or by `wake`."""
        me, alarm = threading.current_thread(), threading.Event()
        self._sleepers.add(me)
        self._asleep[me] = alarm
        self.at(self._now + seconds, lambda: self.wake(alarm))
        return alarm

    def wake(self, alarm: threading.Event) -> None:
        """Set an alarm off; its thread counts as awake from now on."""
        for thread, its in list(self._asleep.items()):
            if its is alarm:
                del self._asleep[thread]
        alarm.set()

    def wait(self, alarm: threading.Event) -> None:
        """Until the alarm goes off."""
        assert alarm.wait(HANG_S), "nobody lets time pass"


class Queue:
    """queue.Queue whose timeout is by the drone's clock; for the one thread that gets."""

    def __init__(self, clock: Clock) -> None:
        self._clock, self._items, self._lock = clock, [], threading.Lock()
        self._alarm = threading.Event()

    def put(self, item: object) -> None:
        """See queue.Queue."""
        with self._lock:
            self._items.append(item)
            self._clock.wake(self._alarm)

    def get(self, block: bool, timeout: float) -> object:
        """See queue.Queue."""
        with self._lock:
            if not self._items:
                self._alarm = self._clock.fall_asleep(timeout)
        if not self._items:
            self._clock.wait(self._alarm)
        with self._lock:
            if not self._items:
                raise queue.Empty
            return self._items.pop(0)


class SimulatedDrone(Server):
    """The virtual drone with its faults, and what cflib sent to it.

    sent: every packet. script: (packet, its answers) -> the answers that go out, for a test that changes them.
    """

    def __init__(self, *arguments, **settings) -> None:
        super().__init__(*arguments, port=0, **settings)
        self.close()  # nobody comes through the socket
        self.uri = URI
        self.links: list[Link] = []
        self.sent: list[Packet] = []
        self.script: Callable[[Packet, list[Packet]], list[Packet]] = lambda packet, answers: answers
        self._turn = threading.RLock()
        self.clock = Clock(self)

    def delay(self, seconds: float) -> None:
        """From now on every packet is under way for so long, there as back."""
        always: Any = SimpleNamespace(random=lambda: 1.0)  # as late as can be
        self._up, self._down = (Line([Fault("late", amount=seconds)], always) for _ in range(2))

    def once_it_logs(self, action: Callable[[], None]) -> None:
        """Call `action` at the first log block, when cflib has connected."""
        def script(packet: Packet, answers: list[Packet]) -> list[Packet]:
            if packet in [Packet(LOG, SETTINGS, data) for data in self.settings(CREATE)]:
                self.script = lambda packet, answers: answers
                action()
            return answers

        self.script = script

    def take(self, packet: Packet, link: "Link") -> None:
        """A packet of cflib's."""
        with self._turn:
            self.sent.append(packet)
            if self.drone.now_s >= self._cut_until_s:
                self._up.put(packet, link, self.drone.now_s)
            self._exchange(self.drone.now_s)

    def answers(self, packet: Packet) -> list[Packet]:
        """What the firmware says to a packet, as the script wants it."""
        return self.script(packet, super().answers(packet))

    def tick(self) -> None:
        """10 ms pass."""
        with self._turn:
            self.step(lambda _: None)

    def send(self, packet: Packet, peer: Any) -> None:
        """To one of the links."""
        if not peer.closed:
            peer.inbox.put(packet)

    def busy(self) -> bool:
        """Whether cflib still deals with what came."""
        return any(link.busy() for link in self.links)

    def settings(self, command: int) -> list[bytes]:
        """The log settings with this command that cflib sent."""
        return [p.data for p in self.sent if (p.port, p.channel) == (LOG, SETTINGS) and p.data[0] == command]


class Link(CRTPDriver):
    """cflib's driver of a SimulatedDrone. about_to_send: called when cflib has seen the link, before it sends."""

    def __init__(self, drone: SimulatedDrone) -> None:
        self._drone = drone
        self.inbox: queue.Queue[Packet] = queue.Queue()
        self.about_to_send: Callable[[], None] = lambda: None
        self.closed, self._taken = False, False
        self._cf: Any = None
        self._reads: dict[threading.Thread, int] = {}

    @property
    def needs_resending(self) -> bool:
        """True, as over a radio without safe link."""
        self.about_to_send()
        return True

    def connect(self, uri, radio_link_statistics_callback, link_error_callback):
        """See CRTPDriver."""
        if uri != self._drone.uri:
            raise WrongUriType
        self._cf = link_error_callback.__self__
        self._drone.links.append(self)

    def send_packet(self, pk):
        """See CRTPDriver."""
        if pk.port == PARAM:
            me = threading.current_thread()
            self._reads[me] = self._reads.get(me, 0) + 1
        if not self.closed:
            self._drone.take(Packet(pk.port, pk.channel, bytes(pk.data)), self)

    def receive_packet(self, wait=0):
        """See CRTPDriver. Who asks for the next packet has dealt with the last one."""
        if self._taken:
            self._taken = False
            self.inbox.task_done()
        try:
            packet = self.inbox.get(timeout=min(wait, 0.05))
        except queue.Empty:
            return None
        self._taken = True
        return CRTPPacket(packet.port << 4 | packet.channel, packet.data)

    def close(self):
        """See CRTPDriver."""
        self.closed = True

    def busy(self) -> bool:
        """Whether packets wait for cflib's receiver, or requests for its reader of parameters."""
        if self.closed:
            return False
        reader = self._cf.param.param_updater
        waiting = (reader is not None and reader._lock_pattern is None
                   and self._reads.get(reader, 0) < reader.request_queue.unfinished_tasks)
        return bool(self.inbox.unfinished_tasks or waiting)


@contextlib.contextmanager
def simulated(monkeypatch, scenario="hover", **settings) -> Iterator[SimulatedDrone]:
    """A drone at URI, its clock for everybody; `settings` as for sitl.serve."""
    drone = SimulatedDrone(scenario, **settings)

    class Timer:
        """threading.Timer by the drone's clock."""

        def __init__(self, interval, function):
            self._interval, self._function, self._over = interval, function, False

        def start(self):
            drone.clock.at(drone.clock.monotonic() + self._interval, self._run)

        def cancel(self):
            self._over = True

        def _run(self):
            if not self._over:
                self._function()

    with monkeypatch.context() as patch:
        patch.setattr("cflib.crtp.CLASSES", [lambda: Link(drone)])
        patch.setattr("cflib.crazyflie.Timer", Timer)
        patch.setattr("cflib.positioning.motion_commander.Queue", lambda: Queue(drone.clock))
        patch.setattr("cflib.crazyflie.link_statistics.LinkStatistics.start", lambda statistics: None)
        for name in CLOCKED:
            patch.setattr(f"{name}.time", drone.clock)
        yield drone
