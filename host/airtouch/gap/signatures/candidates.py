"""How each effect of the registry is fitted: its free parameters, its variants, how it shows.

An effect that adds a known force, delay or gain moves the gap's mean; one that is random
changes its spectrum; one of the clock or the radio shows in the logged times alone.
An effect that this table does not know (a user's own) has every parameter with a neutral
value free, and counts as random when two seeds give two forces.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from airtouch.gap.result import Found, Quantity
from airtouch.simulation import signals as at
from airtouch.simulation.effects import EFFECTS, Active, Effect, Parameter, get

#: how an effect shows: in the mean of the gap, in its spectrum, in the logged times alone
MEAN, SPECTRUM, CLOCK = "mean", "spectrum", "clock"
WITHIN_90 = 1.645  #: standard deviations of a normal variable on either side that hold 90 %
RANGE_STEP = 0.05  #: natural step, as a fraction of its range, of a parameter whose default is neutral; chosen
#: parameters that a fit frees, by effect; the others have the same effect in most logs
_FREE = {
    "ground_effect": ("strength",), "rotor_drag": ("horizontal", "vertical"), "wind": ("x", "y", "z"),
    "gust": ("rms",), "blade_flapping": ("tilt",), "motor_lag": ("factor",), "motor_noise": ("rms",),
    "thrust_coefficient": ("loss",), "weak_motor": ("thrust_loss",), "battery_sag": ("strength",),
    "mass": ("fraction",), "com_offset": ("x", "y"), "inertia": ("fraction",), "slung_load": ("load",),
    "imu_bias": ("acc_x", "acc_y", "acc_z", "gyro_x", "gyro_y", "gyro_z"), "imu_noise": ("factor",),
    "vibration": ("amplitude",), "sensor_latency": ("delay",), "actuator_delay": ("delay",),
    "time_jitter": ("rms",), "packet_loss": ("share",), "range_step": ("residual", "kick"),
    "flow_scale": ("share", "transient"), "downwash": ("strength",),
    "controller_gain": ("rate", "attitude", "position", "height"),
}
#: effects that do not show in the mean
_KIND = {"gust": SPECTRUM, "motor_noise": SPECTRUM, "imu_noise": SPECTRUM, "vibration": SPECTRUM,
         "time_jitter": CLOCK, "packet_loss": CLOCK}
#: values of parameters that are tried one by one, in their units (m, s, fractions, number of the rotor); chosen, a
#: factor of two to five apart, so that a fit between two of them loses little
_VARIANTS: dict[str, tuple[dict[str, float], ...]] = {
    "ground_effect": tuple({"fade": x} for x in (0.0, 0.06, 0.0875, 0.129)),
    "weak_motor": tuple({"rotor": i} for i in (1, 2, 3, 4)),
    "slung_load": tuple({"length": x} for x in (0.1, 0.2, 0.4)),
    "wind": ({}, {"lever": 0.015}),  # a known height: free, any torque would be wind
    "gust": tuple({"length": x} for x in (0.2, 0.5, 1.5)),
    "motor_noise": tuple({"time": x} for x in (0.005, 0.02, 0.1)),
    "battery_sag": tuple({"charge": x, "capacity": c} for x in (0.95, 0.8, 0.6, 0.4) for c in (0.2, 1.0)),
}
#: parameters that are freed once a fit of the others is close
_LATER = {"battery_sag": ("charge", "capacity"), "slung_load": ("length",)}
#: a shape that half of the data can hardly tell: its parameter and the values, of which all the data choose in the end
_SHAPES = {"ground_effect": ("fade", (0.0, 0.06, 0.0875, 0.105, 0.129, 0.16, 0.22))}
_ONE_BY_ONE = frozenset({"controller_gain"})  #: effects whose parameters are also tried alone
#: values of parameters of a mean part, whose random part is a term of its own (`random_part_of`)
_FIXED = {"ground_effect": {"turbulence": 0.0}, "downwash": {"turbulence": 0.0, "width": 0.0}}
GATED = ("wind", "gust", "downwash")  #: effects that may come and go within a flight
OVERHEAD = "downwash"  #: the effect of another vehicle overhead
SHAKES = frozenset({"downwash"})  #: effects that are only tried with their random part: the mean alone has other names
UNSTEADY = ("ground_effect", "downwash")  #: effects with a random part, where and when their mean part acts
#: relative standard deviation of a strength from flight to flight that no likelihood shows: lines of four rotors at
#: nearly one speed add up as their phases happen to stand (Rayleigh, sqrt(4 / pi - 1)); the height over an edge comes
#: from one late, noisy range reading for all rotors (13 simulated flights of opened sealed sets)
OWN_SCATTER = {"vibration": 0.52, "ground_effect": 0.07}
#: share of the samples, and how many of them go in a row: bursts are Poisson's, their lengths geometric
COUNTED = {"packet_loss": ("share", "burst")}
#: effects with a variant that has another effect beside it: air moves the vehicle through its rotors' drag
COMPANIONS = {"wind": "rotor_drag", "gust": "rotor_drag"}
#: names for one thing in the logs at hand, with what would tell them apart
ALIKE = (
    (frozenset({"mass", "thrust_coefficient"}),
     "add a fast climb or drop: the same thrust moves a heavier vehicle less, in proportion to its mass only "
     "where an outside force acts; weigh the vehicle, or run one motor on a scale"),
    # one push against the speed; below 0.5 m/s flapping's moment (lever 15 mm) drowns in the floor
    (frozenset({"rotor_drag", "blade_flapping"}),
     "fly at 1.5 m/s or more, with climbs and drops at speed: flapping's push grows with thrust, rotor drag "
     "with rotor speed, and only flapping pitches the vehicle, if the drag acts at the centre of mass"),
)


@dataclass(frozen=True)
class Term:
    """An effect as a hypothesis: values of every parameter, those that are free, and how it shows."""

    effect: Effect
    kind: str
    free: tuple[str, ...]
    values: Mapping[str, float] = field(default_factory=dict)
    companion: bool = False  #: in the model because another effect implies it; not reported itself
    gate: tuple[tuple[str, float, float], ...] = ()  #: (flight, from_s, to_s): when it acts; none: always

    @property
    def name(self) -> str:
        """Name of the effect in the registry."""
        return self.effect.name

    def active(self, x: np.ndarray | None = None) -> Active:
        """The effect at scaled parameters x (0: neutral, 1: its default), clipped to its bounds."""
        return Active(self.effect, dict(self.values) if x is None else self.at(x), self.gate)

    def at(self, x: np.ndarray) -> dict[str, float]:
        """Values of all parameters, in their units, at scaled parameters x, clipped to their bounds."""
        values = dict(self.values)
        for name, amount in zip(self.free, x, strict=True):
            p = self._parameter(name)
            values[name] = float(min(max(neutral_of(p) + amount * unit(p), p.low), p.high))
        return values

    def fitted(self, x: np.ndarray) -> "Term":
        """The term with the values that scaled parameters x stand for."""
        return replace(self, values=self.at(x))

    def refined(self) -> "Term":
        """The term with those parameters free too that are fitted last."""
        later = tuple(p for p in _LATER.get(self.name, ()) if p not in self.free)
        return replace(self, free=self.free + later) if later else self

    def shaped(self) -> "list[Term]":
        """The term in each shape that all the data may choose among; none where its effect has no shapes."""
        name, values = _SHAPES.get(self.name, ("", ())) if self.kind == MEAN else ("", ())
        return [replace(self, values={**self.values, name: v}) for v in values]

    @property
    def acts_when_neutral(self) -> bool:
        """Whether the effect changes anything while its free parameters are neutral (a shape that is not)."""
        return not all(p.neutral is not None or p.name in self.free for p in self.effect.parameters) \
            and self.effect.settings is not None

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest scaled values (k,) of the free parameters."""
        low, high = [], []
        for name in self.free:
            p = self._parameter(name)
            low.append((p.low - neutral_of(p)) / unit(p))
            high.append((p.high - neutral_of(p)) / unit(p))
        return np.array(low), np.array(high)

    def scaled(self, values: Mapping[str, float]) -> np.ndarray:
        """Scaled values (k,) of the free parameters, from values in their units."""
        return np.array([(values[n] - neutral_of(self._parameter(n))) / self.step(n) for n in self.free])

    def among_all(self, x: np.ndarray, other: float = 0.0) -> np.ndarray:
        """Values (k,) of the first k free parameters in their places among all that its effect may have free.

        other: the value of those that this variant leaves alone. A random part has its own alone.
        """
        names = free_of(self.effect)
        if not set(names) & set(self.free):
            return np.array(x[:len(self.free)])
        out = np.full(len(names), other)
        for name, value in zip(self.free, x, strict=False):
            if name in names:
                out[names.index(name)] = value
        return out

    def step(self, name: str) -> float:
        """The natural step of a parameter."""
        return unit(self._parameter(name))

    def quantities(self, scaled: np.ndarray, covariance: np.ndarray | None = None) -> dict[str, Quantity]:
        """Every parameter with its unit, the free ones with their 90 % interval."""
        values, out = self.at(scaled), {}
        for p in self.effect.parameters:
            if p.name not in self.free:
                out[p.name] = Quantity(values[p.name], unit=p.unit)
                continue
            i = self.free.index(p.name)
            half = 0.0 if covariance is None else WITHIN_90 * float(np.sqrt(max(covariance[i, i], 0.0))) * unit(p)
            out[p.name] = Quantity(values[p.name], max(values[p.name] - half, p.low),
                                   min(values[p.name] + half, p.high), p.unit)
        return out

    def _parameter(self, name: str) -> Parameter:
        return parameter_of(self.effect, name)


def parameter_of(effect: Effect, name: str) -> Parameter:
    """The parameter of an effect with a name."""
    return next(p for p in effect.parameters if p.name == name)


def unit(p) -> float:
    """The natural step of a parameter, in its unit: from neutral to default, else RANGE_STEP of its range."""
    step = abs(p.default - neutral_of(p))
    return step if step > 0.0 else RANGE_STEP * (p.high - p.low)


def neutral_of(p: Parameter) -> float:
    """The value of a parameter at which its effect does nothing; 0 where it has none."""
    return 0.0 if p.neutral is None else p.neutral


def terms(name: str) -> list[Term]:
    """The hypotheses of one effect, one for each variant, with all free parameters at neutral."""
    effect = get(name)
    free = free_of(effect)
    kind = _KIND.get(name) or (MEAN if name in _FREE or not _random(effect) else SPECTRUM)
    base = effect.scaled(effect.values(), 0.0) | _FIXED.get(name, {})
    alone = [Term(effect, kind, (p,), base) for p in free] if name in _ONE_BY_ONE else []
    return [Term(effect, kind, free, base | variant) for variant in _VARIANTS.get(name, ({},))] + alone


def free_of(effect: Effect) -> tuple[str, ...]:
    """Names of the parameters of an effect that a fit begins with."""
    return _FREE.get(effect.name) or tuple(p.name for p in effect.parameters if p.neutral is not None)


def all_candidates(without: Iterable[str] = ()) -> dict[str, list[tuple[Term, ...]]]:
    """The variants of every effect of the registry but those of `without`, by name and in its order.

    Moving air acts through the rotors' drag, and drag that acts on the air's velocity acts
    on the vehicle's own: a variant of `wind` and `gust` has drag of its own beside it.
    """
    without = set(without)
    out: dict[str, list[tuple[Term, ...]]] = {name: [(t,) for t in terms(name)] for name in EFFECTS
                                              if name not in without}
    for name in UNSTEADY:
        if name in out:
            shaking: list[tuple[Term, ...]] = [(*v, random_part_of(name)) for v in out[name]]
            out[name] = shaking if name in SHAKES else out[name] + shaking
    for name in COMPANIONS:
        if name in out and COMPANIONS[name] not in without:
            drag = [replace(t, companion=True) for t in terms(COMPANIONS[name])]
            out[name] += [(*v, *drag) for v in out[name]]
    return out


def gated(without: Iterable[str] = ()) -> dict[str, list[tuple[Term, ...]]]:
    """The variants of effects that may come and go, by name; `passing.gates` sets their gates."""
    without = set(without)
    out: dict[str, list[tuple[Term, ...]]] = {name: [(t,) for t in terms(name)] for name in GATED
                                              if name in EFFECTS and name not in without}
    return {n: [(*t, random_part_of(n)) for t in v] if n in UNSTEADY else v for n, v in out.items()}


def random_part_of(name: str) -> Term:
    """The random part of an effect, where and when its mean part acts."""
    effect = get(name)
    neutral = {"turbulence": 0.0, **({"width": 0.0} if name == "downwash" else {})}
    return Term(effect, SPECTRUM, ("turbulence",), effect.values({"strength": 1.0, **neutral}), True)


def strength_term(terms: Sequence[Term]) -> Term:
    """The term whose strength is that of the effect: the random part of an effect that SHAKES, else the first."""
    return terms[-1] if terms[0].name in SHAKES else terms[0]


def random_of(terms: Sequence[Term]) -> list[Term]:
    """The terms that add power, whose phase is not known."""
    return [t for t in terms if t.kind == SPECTRUM]


def is_random(name: str) -> bool:
    """Whether an effect's strength is that of a random force, which no strength below 0 has."""
    return name in SHAKES or name in EFFECTS and terms(name)[0].kind == SPECTRUM


def term_of(effect: Found) -> Term:
    """The term of an effect that a diagnosis named, with its values."""
    values = {k: q.value for k, q in effect.parameters.items()}
    nearest = min(terms(effect.name), key=lambda t: sum(abs(values.get(k, v) - v) for k, v in t.values.items()
                                                       if k not in t.free))
    return replace(nearest, values={**nearest.values, **values}, gate=effect.seconds)


def names_alike(name: str) -> tuple[frozenset[str], str] | None:
    """The set of effects that these logs do not separate from this one, and what would; None without one."""
    return next(((group, advice) for group, advice in ALIKE if name in group), None)


def interchangeable(one: str, other: str) -> bool:
    """Whether two names stand for one thing in these logs."""
    group = names_alike(one)
    return one == other or (group is not None and other in group[0])


def _random(effect: Effect) -> bool:
    """Whether two seeds give two forces on the same signals, of a small drone that flies 0.1 m high at 0.5 m/s."""
    if effect.wrench is None:
        return False
    from airtouch.simulation import replay
    signals = np.zeros((50, at.COUNT))
    signals[:, at.STEP], signals[:, at.MASS], signals[:, at.GRAVITY] = 0.01, 0.03, 9.81
    signals[:, at.HOVER_SPEED], signals[:, at.ROTOR_SPEED:at.ROTOR_SPEED + 4] = 2000.0, 2000.0
    signals[:, at.THRUST:at.THRUST + 4] = 0.08
    signals[:, at.ROTATION], signals[:, at.ROTATION + 4], signals[:, at.ROTATION + 8] = 1.0, 1.0, 1.0
    signals[:, at.VELOCITY] = 0.5
    signals[:, at.LOWER_HEIGHT:at.UPPER_HEIGHT + 4], signals[:, at.HEIGHT] = 0.1, 0.1
    active = Active(effect, effect.values())
    first, second = (replay.wrench_of(active, signals, seed) for seed in (1, 2))
    return not np.allclose(first, second)
