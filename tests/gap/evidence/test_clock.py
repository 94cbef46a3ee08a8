"""Effects that only the log's times show: against drawn times of known jitter and loss."""

from types import SimpleNamespace

import numpy as np

from airtouch.gap.evidence import clock
from airtouch.gap.signatures.candidates import terms


def test_clock_and_losses_count_as_unknown_only_where_they_are_not_named():
    rng = np.random.default_rng(2)
    times, lost_rows = rng.normal(0.0, 4e-3, 2000), rng.random(2000) < 0.05
    floor = SimpleNamespace(clock_s=1e-3, lost=1e-3)
    data = SimpleNamespace(flights=[SimpleNamespace(clock_s=times, lost=lost_rows)],
                           study=SimpleNamespace(floor=floor, loop=None))
    extra, gain = clock.jitter(data)
    np.testing.assert_allclose(extra, np.sqrt(4.0 ** 2 - 1.0) * 1e-3, rtol=0.05)
    share, loss_gain = clock.loss(data)
    np.testing.assert_allclose(share, 0.05, rtol=0.3)
    assert clock.clock_left(data, ()) == gain + loss_gain
    assert clock.clock_left(data, terms("time_jitter")) == loss_gain
    assert clock.clock_left(data, [*terms("time_jitter"), *terms("packet_loss")]) == 0.0
