"""cflib's Crazyflie, made safe against its own threads.

A receiver, a parameter reader and a timer for each unanswered packet use `link` and the table of unanswered
packets. In cflib `link` turns None and an entry disappears between their look and their use of it. They then
end with an AttributeError or a KeyError, in `send_packet` with the sender's lock held, so that nothing can be
sent any more. Importing this module needs cflib.
"""

import time
from typing import Any

import cflib.crazyflie
from cflib.utils.callbacks import Caller

POLL_S = 0.1  #: between two looks of a receiver whose link is closed


class NoLink:
    """A link that is closed: it takes every packet, gives none, and is false."""

    needs_resending = False

    def __bool__(self) -> bool:
        return False

    def send_packet(self, packet: Any) -> None:
        """Drop it."""

    def receive_packet(self, wait: float = 0) -> None:
        """None, after at most POLL_S."""
        time.sleep(min(max(wait, 0.0), POLL_S))

    def close(self) -> None:
        """Nothing is open."""


class Unanswered(dict):
    """Pattern of an answer -> timer that sends the packet again; other threads may remove what one looks at.

    A packet with the same pattern takes the older one's place, and its timer ends.
    """

    class Answered:
        """The timer of a packet that has been answered."""

        def __bool__(self) -> bool:
            return False

        def cancel(self) -> None:
            """Nothing is to be cancelled."""

    def __missing__(self, pattern: Any) -> Answered:
        return self.Answered()

    def __setitem__(self, pattern: Any, timer: Any) -> None:
        self[pattern].cancel()
        super().__setitem__(pattern, timer)

    def __delitem__(self, pattern: Any) -> None:
        self.pop(pattern, None)


class Crazyflie(cflib.crazyflie.Crazyflie):
    """See cflib. `link` is false, never None, where there is none; `resent` is called with repeated packets."""

    def __init__(self, *arguments: Any, **settings: Any) -> None:
        self.resent = Caller()
        self._unanswered = Unanswered()
        super().__init__(*arguments, **settings)

    @property
    def link(self) -> Any:
        """The driver, or NoLink."""
        return self._link

    @link.setter
    def link(self, driver: Any) -> None:
        self._link = NoLink() if driver is None else driver

    @property
    def _answer_patterns(self) -> Unanswered:
        return self._unanswered

    @_answer_patterns.setter
    def _answer_patterns(self, _: dict) -> None:  # cflib empties it when it starts and when it closes
        old, self._unanswered = self._unanswered, Unanswered()
        for timer in list(old.values()):
            timer.cancel()

    def send_packet(self, pk: Any, expected_reply: tuple = (), resend: bool = False, timeout: float = 0.2) -> None:
        """See cflib; a repeated packet is told to `resent` before it is sent. Without a link it is dropped."""
        if resend:
            self.resent.call(pk)
        if self.link:
            super().send_packet(pk, expected_reply, resend, timeout)
