"""Evidence in the echo of the gyro's fast noise (`loop.noise_echo`): whether the controllers see late.

Effects with `delays_sensing` gain the log likelihood of another echo than in nominal flights. The gain does not depend
on the fitted delay, because the row of a late echo depends on how loop and log are timed. Where the echo is another
one, the noise in the measured torque no longer follows the commands as in nominal flights. So those values of the
torque that this noise may make count no longer, unless the loop is the firmware's, of which a model says how they
change (`flattened`). Where the relations of signals decide, the echo is no evidence.

In recorded flights the echo does not count. It differs from one nominal flight to the next by 3 to 20 times the
variance of chance, in simulated ones by that of chance alone. Two of 177 recorded nominal flights would have another
echo than others of their day (host/docs/looks.md, 2026-11-28 08:50).
"""

from collections.abc import Sequence

from airtouch.gap.evidence.clock import clock_gains, unexplained_clock_gain
from airtouch.gap.evidence.data import Data
from airtouch.gap.loop.noise_echo import changed_nats, echo_of
from airtouch.gap.signatures.term import Term

LEAST_CHANGED = 6.0  #: nats from which on the echo is another one: odds of 400; chosen with flights in view


def changed_echo_nats(data: Data) -> float:
    """Nats that another echo gains over that of nominal flights; 0 where it gains less than LEAST_CHANGED.

    It is 0 too in recorded flights, and where nominal flights, or one of the flights, have no echo.
    """
    return data.workspace.cached("changed echo", (), lambda: _changed_echo_nats(data))


def _changed_echo_nats(data: Data) -> float:
    """`changed_echo_nats`, worked out."""
    study = data.study
    if study.echo is None or not study.simulated:
        return 0.0
    echoes = [e for e in (echo_of(f, study.vehicle) for f in data.flights) if e is not None]
    nats = changed_nats(study.echo, echoes) if len(echoes) == len(data.flights) else 0.0
    return nats if nats > LEAST_CHANGED else 0.0


def sensing_gain(data: Data, terms: Sequence[Term]) -> float:
    """Nats that effects gain by the echo: those of another one, if one of them delays what the controllers see."""
    return changed_echo_nats(data) if any(t.signature.delays_sensing for t in terms) else 0.0


def gain_outside(data: Data, terms: Sequence[Term]) -> float:
    """Nats that effects gain outside the spectra: by the logged times and by the echo."""
    return clock_gains(data, terms) + sensing_gain(data, terms)


def unexplained_outside(data: Data, terms: Sequence[Term]) -> float:
    """Nats outside the spectra, of logged times and echo, that no effect explains."""
    return unexplained_clock_gain(data, terms) + changed_echo_nats(data) - sensing_gain(data, terms)
