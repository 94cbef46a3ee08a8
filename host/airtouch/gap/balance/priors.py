"""What the judgement of a hover takes as known beforehand, of vehicles and of defects.

The values without another source were chosen with CrazyPAD's conditions in view (host/docs/gap-crazypad.md). What the
answer loses where some of them are chosen anew without the condition judged: `python
tools/diagnosis/gap_crazypad.py FLIGHTS --leave-one-out`.
"""

from dataclasses import dataclass
from typing import NamedTuple


class Normal(NamedTuple):
    """A normal distribution."""

    mean: float
    deviation: float


class PowerChange(NamedTuple):
    """Change of log10 power in hover that a defect causes."""

    unsteadiness: Normal
    heave: Normal


STEADY = PowerChange(Normal(0.0, 0.0), Normal(0.0, 0.0))

#: Prior probability of what may be the case; they add up to 1. Chosen: no effect, weak rotors, weights (`mass` and
#: `com_offset`) and a load on a thread, which are CrazyPAD's four families, have about a quarter each.
PRIOR_PROBABILITY = {"none": 0.25, "one weak rotor": 0.15, "two weak rotors": 0.10, "mass": 0.20, "slung_load": 0.25,
                     "com_offset": 0.03, "unknown": 0.02}


@dataclass(frozen=True)
class Priors:
    """Scatter of vehicles, and size of defects.

    nominal (6,): standard deviations of balance and log10 power between flights of a vehicle as it should be, without
    what corrections of the estimate cause. Propellers of one kind differ by 2 % in thrust (0.01 in each of the first
    four), a battery slid by 1 mm moves the centre of mass by 0.2 mm, thrust at a voltage is known to 1 %; that of the
    powers is chosen.
    nominal_flights: flights that this scatter is worth beside that of the baseline flights; chosen.
    maintenance (4,): standard deviations by which the balance differs besides after maintenance, as another set of
    propellers has another torque. There is maintenance before every defect, and before half of the flights without one.
    It is what 16 of CrazyPAD's building conditions differ by beyond their cuts (`python
    tools/diagnosis/gap_crazypad_balance.py FLIGHTS`).
    freedom: degrees of freedom of the Student law of the balance, as a set of propellers may be far off; chosen.
    thrust_loss: standard deviation of the half-normal prior of the fraction of thrust that a rotor loses; chosen.
    added_mass: the same of an added fraction of the mass; chosen.
    slung_mass: the same of a fraction of the mass on a thread, which may rest on the floor; chosen.
    reach: farthest place of a weight, over the arm; chosen.
    shift_m: standard deviation of the normal prior of a centre of mass that moved; chosen.
    damaged: unsteadiness and heave with a damaged rotor, rounded from CrazyPAD's building conditions (`python
    tools/diagnosis/gap_crazypad.py FLIGHTS --corrections`): 18 of rotors 0.12 +- 0.25 and -0.20 +- 0.19. Four of
    weights, on tape or a thread, -0.03 +- 0.11 and 0.07 +- 0.10, which is nothing: a weight is STEADY.
    unknown: standard deviation of each number of the balance that a nameless change changes; chosen.
    """

    nominal: tuple[float, ...] = (0.012, 0.011, 0.011, 0.014, 0.2, 0.2)
    nominal_flights: float = 0.5
    maintenance: tuple[float, ...] = (0.013, 0.008, 0.008, 0.024)
    freedom: float = 4.0
    thrust_loss: float = 0.12
    added_mass: float = 0.1
    slung_mass: float = 0.02
    reach: float = 1.2
    shift_m: float = 0.002
    damaged: PowerChange = PowerChange(Normal(0.15, 0.25), Normal(-0.2, 0.2))
    unknown: float = 0.15


PRIORS = Priors()
