"""How many flights a library is learned and calibrated from, and how many directions of them it keeps.

The defaults made the shipped library. They were chosen with the library of 2026-11-24, on flights of `learning.SEED`
alone (host/docs/looks.md, 2026-11-24, 12:43 UTC, and 2026-11-25, 09:07 UTC); what other values were tried
is not recorded. They take half an hour of one core; tests learn from fewer flights.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class CalibrationSettings:
    """Numbers of flights by which a library is calibrated; none of them is one that it was learned from.

    A larger number takes more time in proportion; what else it does stands with each.
    """

    #: flights without effects, for the distribution of their distance (`Library.distance`). More make it more certain
    nominal_flights: int = 300
    #: flights of each class, of which those that show it count, for its shares and parameters. More make both more
    #: certain
    class_flights: int = 80
    #: of these, those beside whose effect a second one is tried, for `ClassCalibration.second_share`. More make it
    #: more certain
    flights_with_second: int = 12
    #: flights with two effects, for `Library.pair_distance_scatter`. More make it more certain
    flights_of_two: int = 150
    #: flights at each strength, on the way down to the weakest one that shows. More find that strength more exactly
    flights_per_strength: int = 3
    #: flights that show the effect; with fewer a class gives no parameters. A larger number leaves more classes without
    least_flights: int = 12


@dataclass(frozen=True)
class BuildSettings:
    """Numbers of flights that a library is learned from, and of directions of the features that it stores.

    A larger number takes more time, or a larger file, in proportion; what else it does stands with each.
    """

    #: flights without effects, for the covariance of the features, of which there are half as many. More make it more
    #: certain
    nominal_flights: int = 5000
    #: flights with a nameless disturbance, for the directions and the scatter of such. More show more kinds of them
    nameless_flights: int = 3000
    #: flights with two effects, for `LearnedModel.interaction`. More show more pairs
    flights_of_two: int = 300
    #: flights of a class for each knot of its curve, twice as many for several parameters. More make the curve more
    #: certain
    flights_per_knot: int = 60
    #: flights at a strength whose median shift says whether a class shows there. More find the weakest more exactly
    weakest_flights: int = 3
    #: directions that are stored for nameless disturbances. More tell more of these from effects
    directions_of_nameless: int = 160
    #: directions that are stored for each class. More follow the bends of its curve more closely
    directions_of_class: int = 6
    #: directions of the scatter of nameless disturbances. More explain more kinds of them
    rank_of_nameless: int = 120
    #: directions, at most, in which two effects are not their sum. More explain more of what pairs do
    rank_of_interaction: int = 24
    #: flights that it is calibrated by
    calibration: CalibrationSettings = CalibrationSettings()


@dataclass(frozen=True)
class OwnEffectSettings:
    """Numbers of flights of an effect that the library lacks; chosen for time, as its user waits for them."""

    #: flights with the effect, and as many without, of which its class is learned. More make its curve more certain
    pairs: int = 40
    #: of these, those that must end well and show the effect; else it gets no class. A larger number leaves more
    #: effects without a class
    least_pairs: int = 20
    #: flights that it is calibrated by
    calibration: CalibrationSettings = CalibrationSettings(class_flights=24)


SHIPPED = BuildSettings()  #: of the library that comes with the package
OWN_EFFECT = OwnEffectSettings()
