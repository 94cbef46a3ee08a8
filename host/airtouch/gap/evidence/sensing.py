"""Evidence in how the commands answer the gyro's fast noise (`loop.noise_answer`): whether the controllers see it late.

The answer is no part of the spectra. An effect that delays what the controllers see gains what another answer gains
over that of nominal flights, whatever its delay: in which row a later answer shows depends on how loop and log are
timed. Where the answer is another one, the noise in the measured torque no longer follows the commands as in nominal
flights. So those values of the torque that this noise may make count no longer, unless the loop is the firmware's, of
which a model says how they change (`flattened`).

In recorded flights the answer does not count. It differs from one nominal flight to the next by 3 to 20 times the
variance of chance, in simulated ones by that of chance alone. Two of 177 recorded nominal flights would have another
answer than others of their day (host/docs/looks.md, 2026-11-28 08:50).
"""

from collections.abc import Sequence

from airtouch.gap.evidence.clock import unexplained_clock_gain
from airtouch.gap.evidence.data import Data
from airtouch.gap.loop.noise_answer import answer_of, changed_nats
from airtouch.gap.signatures.term import Term

LEAST_CHANGED = 6.0  #: nats from which on the answer is another one: odds of 400; chosen


def changed_answer_nats(data: Data) -> float:
    """Nats that another answer gains over that of nominal flights; 0 where it gains less than LEAST_CHANGED.

    It is 0 too in recorded flights, and where nominal flights, or one of the flights, have no answer.
    """
    return data.workspace.cached("changed answer", (), lambda: _changed_answer_nats(data))


def _changed_answer_nats(data: Data) -> float:
    """`changed_answer_nats`, worked out."""
    study = data.study
    if study.answer is None or not study.simulated:
        return 0.0
    answers = [a for a in (answer_of(f, study.vehicle) for f in data.flights) if a is not None]
    nats = changed_nats(study.answer, answers) if len(answers) == len(data.flights) else 0.0
    return nats if nats > LEAST_CHANGED else 0.0


def sensing_gain(data: Data, terms: Sequence[Term]) -> float:
    """Nats that effects gain by the answer: those of another one, if one of them delays what the controllers see."""
    return changed_answer_nats(data) if any(t.signature.delays_sensing for t in terms) else 0.0


def beside_spectra(data: Data, terms: Sequence[Term]) -> float:
    """Nats of logged times and answer that no effect explains, and that the spectra do not show."""
    return unexplained_clock_gain(data, terms) + changed_answer_nats(data) - sensing_gain(data, terms)
