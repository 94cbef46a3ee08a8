"""What the diagnosis knows of each effect: one record an effect, for what the registry does not say.

An effect without a record (a user's own) has every parameter with a neutral value free; `candidates` finds out whether
it is random.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from airtouch.simulation.effects import Effect

#: how an effect shows: in the mean of the gap, in its spectrum, in the logged times alone
MEAN, SPECTRUM, CLOCK = "mean", "spectrum", "clock"
#: closed forms of a random effect's spectrum (`evidence.random_effects`): white noise of the IMU, noise of each rotor's
#: thrust, lines of the rotors
IMU_NOISE, THRUST_NOISE, ROTOR_LINES = "white noise of the IMU", "noise of the thrust", "lines of the rotors"
OVERHEAD = "downwash"  #: the effect of another vehicle overhead
#: effects of which the first that is not the answer is fitted alike, as a deliberately wrong one; chosen, common ones
#: of force, torque and sensors
WRONG = ("rotor_drag", "com_offset", "motor_lag", "thrust_coefficient", "imu_bias")


class Shape(NamedTuple):
    """A parameter that half of the data can hardly tell, and its values, each between those beside it in effect."""

    parameter: str
    values: tuple[float, ...]


class LossRuns(NamedTuple):
    """Names of the two parameters of lost samples: share of all samples, and how many are lost in a row.

    Runs begin as in a Poisson process, their lengths are geometric.
    """

    share: str
    length: str


@dataclass(frozen=True)
class Signature:
    """How one effect is fitted, and where it shows; values in the units of the effect's parameters.

    How it is fitted:
    free: parameters that a fit frees; the others have the same effect in most logs.
    variants: values of parameters that are tried one by one.
    free_later: parameters that are freed once a fit of the others is close.
    shape: a shape of which all the data choose the median in the end; None for an effect without.
    alone_too: whether each free parameter is also tried alone.
    factors: whether its parameters are factors, neutral at 1, of which the logarithm is known.
    own_scatter: relative standard deviation of its strength from flight to flight that no likelihood shows.

    Where it shows:
    shows_in: MEAN (a known force, delay or gain), SPECTRUM (a random one) or CLOCK (the logged times alone).
    delays_sensing: whether the controllers see later what the sensors measure, so that noise is answered later too.
    commands_only: whether it changes what the controller commands and nothing of what the logged commands lead to.
    at_edges: whether it shows in what a flight does at edges.
    near_surfaces: whether it acts near surfaces alone, so that a flight high above them shows nothing of it.
    scales_torque: whether it only multiplies torque, and would shrink any trim.
    spectrum: closed form of a random effect's spectrum; "" where it is run on the flight's signals instead.
    loss_runs: for what loses samples in runs, the parameters that say so.
    may_pass: whether it may act in a part of a flight only.
    free_if_passing: parameters that a fit frees where it does; () for those of `free`.

    What is beside it:
    without_random: values at which the effect has no random part, for a mean part whose random part is a term of its
    own; None for an effect without a random part.
    random_variants: values of the random part that are tried one by one.
    always_random: whether the effect is only tried with its random part, because the mean alone has other names.
    companion: the effect that a variant has beside it; "" without one.
    several_by: parameter of which each value is an effect of its own, several of which may act together; "" for none.
    class_by: parameter of which each value of the variants is a class of its own in the relations of signals.
    """

    free: tuple[str, ...]
    shows_in: str = MEAN
    variants: tuple[Mapping[str, float], ...] = ({},)
    free_later: tuple[str, ...] = ()
    shape: Shape | None = None
    alone_too: bool = False
    factors: bool = False
    own_scatter: float = 0.0
    delays_sensing: bool = False
    commands_only: bool = False
    at_edges: bool = False
    near_surfaces: bool = False
    scales_torque: bool = False
    spectrum: str = ""
    loss_runs: LossRuns | None = None
    may_pass: bool = False
    free_if_passing: tuple[str, ...] = ()
    without_random: Mapping[str, float] | None = None
    random_variants: tuple[Mapping[str, float], ...] = ({},)
    always_random: bool = False
    companion: str = ""
    several_by: str = ""
    class_by: str = ""

    @property
    def loop_only(self) -> bool:
        """Whether the spectra of the closed loop alone show it."""
        return self.commands_only and not self.at_edges

    @property
    def edges_only(self) -> bool:
        """Whether what a flight does at edges alone shows it."""
        return self.commands_only and self.at_edges

    @property
    def loses_rows(self) -> bool:
        """Whether it takes rows from the log; what else shows in the logged times moves them."""
        return self.loss_runs is not None

    @property
    def sensed(self) -> bool:
        """Whether a random effect acts on the IMU, so that no loop fights it."""
        return self.spectrum in (IMU_NOISE, ROTOR_LINES)

    @property
    def random_variant_parameters(self) -> tuple[str, ...]:
        """The parameters that tell the variants of the random part apart."""
        return tuple(dict.fromkeys(name for variant in self.random_variants for name in variant))

    @property
    def class_values(self) -> tuple[float, ...]:
        """The values of `class_by` in the variants, in their order."""
        return tuple(v[self.class_by] for v in self.variants) if self.class_by else ()


def _each(parameter: str, *values: float) -> tuple[Mapping[str, float], ...]:
    """A variant for each value of a parameter."""
    return tuple({parameter: value} for value in values)


#: by name. The values of variants and shapes (m, s, fractions, number of the rotor) were chosen a factor of 1.2 to five
#: apart, so that a fit between two of them loses little
SIGNATURES: dict[str, Signature] = {
    "ground_effect": Signature(
        # each rotor on its own, or all together: recorded flights show less torque than the former
        ("strength",), variants=tuple({"fade": fade, "even": together, "joint": together}
                                      for together in (0.0, 1.0) for fade in (0.0, 0.06, 0.0875, 0.129)),
        shape=Shape("fade", (0.06, 0.0875, 0.105, 0.129, 0.16, 0.22, 0.0)), without_random={"turbulence": 0.0},
        # no yaw torque, or that of rotors under another vehicle (the default of `downwash`)
        random_variants=_each("swirl", 0.0, 0.01), at_edges=True, near_surfaces=True,
        # the height over an edge comes from one late, noisy range reading for all rotors: 13 simulated flights of
        # opened sealed sets
        own_scatter=0.07),
    "rotor_drag": Signature(("horizontal", "vertical")),
    "wind": Signature(
        ("x", "y", "z"), may_pass=True,
        free_if_passing=("x", "y"),  # z acts through the tilt alone: in a few seconds of it any value fits
        variants=({}, {"lever": 0.015}),  # a known height: free, any torque would be wind
        companion="rotor_drag"),  # air moves the vehicle through its rotors' drag
    "gust": Signature(
        ("rms",), SPECTRUM, _each("length", 0.2, 0.5, 1.5), class_by="length", may_pass=True,
        companion="rotor_drag"),
    "blade_flapping": Signature(("tilt", "moment")),
    "motor_lag": Signature(("factor",), factors=True),
    "motor_noise": Signature(
        ("rms",), SPECTRUM, _each("time", 0.005, 0.02, 0.1), class_by="time", spectrum=THRUST_NOISE),
    "thrust_coefficient": Signature(("loss",)),
    "weak_motor": Signature(
        ("thrust_loss",), variants=_each("rotor", 1, 2, 3, 4), several_by="rotor", class_by="rotor"),
    "battery_sag": Signature(
        ("strength",), free_later=("charge", "capacity"),
        variants=tuple({"charge": x, "capacity": c} for x in (0.95, 0.8, 0.6, 0.4) for c in (0.2, 1.0))),
    "mass": Signature(("fraction",)),
    "com_offset": Signature(("x", "y")),
    "inertia": Signature(("fraction",), scales_torque=True),
    "slung_load": Signature(
        ("load",), variants=_each("length", 0.1, 0.2, 0.4), free_later=("length",), class_by="length"),
    "imu_bias": Signature(("acc_x", "acc_y", "acc_z", "gyro_x", "gyro_y", "gyro_z")),
    "imu_noise": Signature(("factor",), SPECTRUM, factors=True, spectrum=IMU_NOISE),
    # lines of four rotors at nearly one speed add up as their phases happen to stand: Rayleigh, sqrt(4 / pi - 1)
    "vibration": Signature(("amplitude",), SPECTRUM, own_scatter=0.52, spectrum=ROTOR_LINES),
    "sensor_latency": Signature(("delay",), commands_only=True, delays_sensing=True),
    "actuator_delay": Signature(("delay",)),
    "time_jitter": Signature(("rms",), CLOCK),
    "packet_loss": Signature(("share",), CLOCK, loss_runs=LossRuns("share", "burst")),
    "range_step": Signature(("residual", "kick"), commands_only=True, at_edges=True),
    "flow_scale": Signature(("share", "transient"), commands_only=True, at_edges=True),
    "downwash": Signature(
        ("strength",), without_random={"turbulence": 0.0, "width": 0.0}, always_random=True, may_pass=True),
    "controller_gain": Signature(
        ("rate", "attitude", "position", "height"), alone_too=True, commands_only=True, factors=True),
}
#: effects of the package without a record: they change readings that only the estimator sees, so that a replay of the
#: logged signals does not show them; the relations of signals do, where a library of these holds
RELATIONS_ONLY = ("range_bias", "flow_latency")
#: passing effects, which may act for some seconds of a flight only
PASSING = tuple(name for name, s in SIGNATURES.items() if s.may_pass)
#: effects that are only tried with their random part
ALWAYS_RANDOM = frozenset(name for name, s in SIGNATURES.items() if s.always_random)
#: effects with a variant that has another effect beside it, and that other
COMPANIONS = {name: s.companion for name, s in SIGNATURES.items() if s.companion}


def signature_of(effect: Effect) -> Signature:
    """The record of an effect; of one without, each parameter with a neutral value is free."""
    known = SIGNATURES.get(effect.name)
    return known or Signature(tuple(p.name for p in effect.parameters if p.neutral is not None))


def free_of(effect: Effect) -> tuple[str, ...]:
    """Names of the parameters of an effect that a fit begins with."""
    return signature_of(effect).free
