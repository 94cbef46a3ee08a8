"""The virtual firmware at the other end of cflib's wire, without radio, socket or clock.

A test decides what becomes of each answer. cflib's timers go off only where an answer is late, or when the
test says so.
"""

import queue
import threading
from collections.abc import Callable

from cflib.crtp.crtpdriver import CRTPDriver
from cflib.crtp.crtpstack import CRTPPacket
from cflib.crtp.exceptions import WrongUriType

from airtouch.sitl import Server
from airtouch.sitl.packet import LOG, Packet

URI = "script://"
CREATE, APPEND, SETTINGS = 6, 7, 1
IDLE_S = 0.001  #: without a packet, then time passes for the drone


class Timer:
    """In the place of threading.Timer: goes off when it is told to."""

    started: list["Timer"] = []
    newest: "Timer | None" = None  #: of the packet that is about to be sent

    def __init__(self, interval: float, function: Callable[[], None]) -> None:
        self._function, self._over = function, False

    def start(self) -> None:
        """Wait to be told."""
        Timer.started.append(self)
        Timer.newest = self

    def cancel(self) -> None:
        """Never go off."""
        self._over = True

    def expire(self) -> None:
        """Go off, once, unless it was cancelled."""
        if not self._over:
            self._over = True
            self._function()


class ScriptedLink(CRTPDriver):
    """A cflib driver. sent: every packet of cflib's.

    script: (packet, its answers) -> (answers that arrive at once, answers that arrive after cflib's timer).
    about_to_send: called after cflib has seen that there is a link, before it uses it.
    turns: how often cflib waits in vain until 10 ms have passed for the drone.
    """

    def __init__(self) -> None:
        server = Server("hover", port=0)
        server.close()
        self.firmware = server.firmware
        self.sent: list[Packet] = []
        self.script: Callable = lambda packet, answers: (answers, [])
        self.about_to_send: Callable[[], None] = lambda: None
        self.turns, self._waited = 1, 0
        self._inbox: queue.SimpleQueue[Packet] = queue.SimpleQueue()
        self._late: queue.SimpleQueue[tuple[Timer, list[Packet]]] = queue.SimpleQueue()
        self._turn = threading.Lock()
        Timer.started, Timer.newest = [], None

    @property
    def needs_resending(self) -> bool:
        """True, as over a radio without safe link."""
        self.about_to_send()
        return True

    @needs_resending.setter
    def needs_resending(self, _: bool) -> None:
        pass

    def connect(self, uri, radio_link_statistics_callback, link_error_callback):
        """See CRTPDriver."""
        if uri != URI:
            raise WrongUriType

    def send_packet(self, pk):
        """The firmware takes it; its answers go where the script says."""
        packet = Packet(pk.port, pk.channel, bytes(pk.data))
        timer, Timer.newest = Timer.newest, None
        with self._turn:
            self.sent.append(packet)
            now, late = self.script(packet, self.firmware.take(packet))
        for answer in now:
            self._inbox.put(answer)
        if late:
            self._late.put((timer, late))

    def receive_packet(self, wait=0):
        """The next packet. Where none is under way late answers come, else 10 ms pass for the drone."""
        try:
            packet = self._inbox.get(timeout=IDLE_S)
            return CRTPPacket(packet.port << 4 | packet.channel, packet.data)
        except queue.Empty:
            pass
        if not self._late.empty():
            timer, answers = self._late.get()
            timer.expire()
        else:
            self._waited += 1
            with self._turn:
                answers = self.firmware.tick() if self._waited % self.turns == 0 else []
        for packet in answers:
            self._inbox.put(packet)
        return None

    def settings(self, command: int) -> list[bytes]:
        """The log settings with this command that were sent."""
        return [p.data for p in self.sent if (p.port, p.channel) == (LOG, SETTINGS) and p.data[0] == command]
