"""cflib's Crazyflie without the races of its threads.

A receiver, a parameter reader and a timer for each unanswered packet share `link` and the table of unanswered
packets. In cflib `link` can become None, and an entry can disappear, between a thread's test and its use. The
thread then dies of an AttributeError or a KeyError. In `send_packet` it dies with the sender's lock held, and
nothing can be sent after that. Importing this module needs cflib.
"""

import time
from typing import Any

import cflib.crazyflie
from cflib.utils.callbacks import Caller

POLL_S = 0.1  #: s between two polls of a closed link


class NoLink:
    """A closed link: it drops every packet, receives none, and is false."""

    needs_resending = False

    def __bool__(self) -> bool:
        return False

    def send_packet(self, packet: Any) -> None:
        """Drop the packet."""

    def receive_packet(self, wait: float = 0) -> None:
        """None, after POLL_S at most."""
        time.sleep(min(max(wait, 0.0), POLL_S))

    def close(self) -> None:
        """Do nothing: there is no open link."""


class Unanswered(dict):
    """Expected answer -> timer that sends the packet again. Safe when several threads add and remove entries.

    A packet with the same expected answer replaces the older one and stops its timer.
    """

    class Answered:
        """The timer of a packet that has been answered."""

        def __bool__(self) -> bool:
            return False

        def cancel(self) -> None:
            """Do nothing: the packet has been answered."""

    def __missing__(self, pattern: Any) -> Answered:
        return self.Answered()

    def __setitem__(self, pattern: Any, timer: Any) -> None:
        self[pattern].cancel()
        super().__setitem__(pattern, timer)

    def __delitem__(self, pattern: Any) -> None:
        self.pop(pattern, None)


class Crazyflie(cflib.crazyflie.Crazyflie):
    """cflib's Crazyflie. Without a link `link` is NoLink, never None. `resent` is called with each repeated packet."""

    def __init__(self, *arguments: Any, **settings: Any) -> None:
        self.resent = Caller()
        self._unanswered = Unanswered()
        super().__init__(*arguments, **settings)

    @property
    def link(self) -> Any:
        """The link's driver; NoLink without a link."""
        return self._link

    @link.setter
    def link(self, driver: Any) -> None:
        self._link = NoLink() if driver is None else driver

    @property
    def _answer_patterns(self) -> Unanswered:
        return self._unanswered

    @_answer_patterns.setter
    def _answer_patterns(self, _: dict) -> None:  # cflib assigns an empty dict when it opens and closes
        old, self._unanswered = self._unanswered, Unanswered()
        for timer in list(old.values()):
            timer.cancel()

    def send_packet(self, pk: Any, expected_reply: tuple = (), resend: bool = False, timeout: float = 0.2) -> None:
        """As cflib's. `resent` is called before a packet is repeated. Without a link the packet is dropped."""
        if resend:
            self.resent.call(pk)
        if self.link:
            super().send_packet(pk, expected_reply, resend, timeout)
