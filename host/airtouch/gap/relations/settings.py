"""How many flights a library is learned and calibrated from, and how many directions of them it keeps.

The defaults made the shipped library. They were chosen with the library of 2026-11-24, on flights of `learning.SEED`
alone (host/docs/looks.md, 2026-11-24, 12:43 UTC, and 2026-11-25, 09:07 UTC); what other values were tried
is not recorded. They take half an hour of one core; tests learn from fewer flights.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class CalibrationSettings:
    """Flights by which a library is calibrated; none of them is one that it was learned from."""

    nominal_flights: int = 300  #: whose distances from no effect are measured
    class_flights: int = 80  #: of each class, of which those that show it count; for its shares and its parameters
    with_second: int = 12  #: of these, those beside whose effect a second one is tried
    flights_of_two: int = 150  #: flights with two effects, for `Library.pair_distance_scatter`
    tried: int = 3  #: flights at each strength, on the way down to the weakest one that shows
    least_flights: int = 12  #: flights that show the effect; with fewer a class gives no parameters


@dataclass(frozen=True)
class BuildSettings:
    """Flights that a library is learned from, and directions that are kept."""

    nominal_flights: int = 5000  #: twice as many as there are features, of which they give the covariance
    nameless_flights: int = 3000  #: flights with a nameless disturbance, for the directions and the scatter of such
    flights_of_two: int = 300  #: flights with two effects, for `LearnedModel.interaction`
    flights_per_knot: int = 60  #: of a class, for each knot of its curve; twice as many for several parameters
    weakest_flights: int = 3  #: whose median shift says whether a class shows at a strength
    directions_of_nameless: int = 160  #: directions that are stored for nameless disturbances
    directions_of_class: int = 6  #: directions that are stored for each class
    rank_of_nameless: int = 120  #: directions of the scatter of nameless disturbances
    rank_of_interaction: int = 24  #: directions, at most, in which two effects are no sum
    calibration: CalibrationSettings = CalibrationSettings()


@dataclass(frozen=True)
class OwnEffectSettings:
    """Flights of an effect that the library lacks; chosen for time, as its user waits for them."""

    pairs: int = 40  #: flights with the effect, and as many without, of which its class is learned
    least_pairs: int = 20  #: of these, that must end well and show the effect; else it gets no class
    calibration: CalibrationSettings = CalibrationSettings(class_flights=24)


SHIPPED = BuildSettings()  #: of the library that comes with the package
OWN_EFFECT = OwnEffectSettings()
