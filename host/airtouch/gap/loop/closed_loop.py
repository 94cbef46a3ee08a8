"""Command view: the closed loop seen in the power spectra of the commands.

What the controller is told is driven by noise that no log holds, so commands cannot be
predicted sample by sample; their spectra can. Flights declared nominal give the spectra
of level flight and, through `loop_model`, the controller and its noise; a hypothesis
then multiplies them by the ratio of the modelled spectra with and without it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property, partial
from typing import Any, NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.optimize import minimize
from scipy.signal import butter, sosfiltfilt

from airtouch.gap.flights.flight import PERIOD_S, Flight
from airtouch.gap.flights.hardness import Slopes, hardness_of, slopes_of
from airtouch.gap.loop.controller import AXES, Controller, firmware, firmware_of
from airtouch.gap.loop.edge_response import EdgeFloor, floor_of
from airtouch.gap.loop.loop_model import (
    NO_STEP,
    Step,
    excess_phase,
    of_loop,
    spectra,
    step_of,
    step_under,
    torque_per_command,
    turnings_per_command,
)
from airtouch.logs.segments import KINDS
from airtouch.simulation.effects import Active
from airtouch.simulation.flight import prepare
from airtouch.vehicle import Vehicle

LENGTH = 128  #: samples of a block
BAND_HZ = (1.5, 40.0)  #: below it set-points, which no log holds, move the commands
HIGHPASS_HZ = 0.6
MIX = 0.25 * np.array([[1, 1, 1, 1], [-1, -1, 1, 1], [-1, 1, 1, -1], [-1, 1, -1, 1]], dtype=np.float64)
EDGE_S = (0.1, 0.4)  #: left out before and after a change of phase at an edge, take-off or landing
PLATFORM = KINDS.index("over platform")
START_S = (0.8, 0.2)  #: the same around hover's end and beginning: set-points step before the speed shows it
STEADY = (KINDS.index("hover"), KINDS.index("cruise"), PLATFORM)
FINE, REACH = 4, 2  #: points a bin, bins a window's leakage is followed
UNSTABLE = 30.0  #: nepers of power per rad of phase beyond stability
FEWEST = 6  #: blocks of nominal flights, for a command view
FREEDOM = 20.0  #: of the tails of a block's power
STEPPED = 5.0  #: times the usual power of its flight: a block in which a set-point stepped
SHAPES = 5  #: smooth shapes by which the floor's logarithm may differ from flight to flight
SPREAD = (0.10, 0.04)  #: their standard deviation: level, other shapes (nepers of power)
#: fields of the plant that make the roll and pitch loops, not their noise
LOOP_FIELDS = ("sensor_delay", "actuator_delay", "rate_gain", "attitude_gain", "position_gain", "motor_rise",
               "motor_fall", "inertia", "rate_scale", "gyro_lowpass", "gyro_bandwidth", "rotor_x", "rotor_y")
SMOOTH = 2.0  #: bins: a block's window and `response.SMOOTH`
PLANTS = 500  #: hypotheses whose plant is cached
LOOPS = 1000  #: spectra of an axis that are cached, about 10 kB each
MOST_CHANGE = 5.0  #: of the share of torque
#: effects that change the commands alone: replayed motor commands hold nothing of them
COMMAND_ONLY = frozenset({"sensor_latency", "controller_gain", "range_step", "flow_scale"})


class Change(NamedTuple):
    """By what effects multiply the torque of a command, complex (bins, 1), and by what the share of the commanded

    torque that turns the vehicle, (2, bins, 3), which the loop model had at `before`: level, and stepped.
    cut (bins, 3): size of that part of the change of stepped blocks which the limits of the command make.
    """

    motors: np.ndarray
    share: np.ndarray
    before: np.ndarray
    cut: np.ndarray


@dataclass(frozen=True)
class ClosedLoop:
    """The nominal loops: a controller, noise strengths (sources,) and floor (bins,) for each of AXES.

    floor: PSD of the commands, N^2/Hz, of `blocks` blocks as hard as nominal ones; slopes: of its power with how
    hard the vehicle is flown; steps: of roll and pitch, in blocks in which a set-point stepped.
    """

    vehicle: Vehicle
    calibration: tuple[Active, ...]
    controllers: tuple[Controller, ...]
    by_firmware: bool
    strengths: tuple[np.ndarray, ...]
    floor: np.ndarray
    blocks: int
    slopes: Slopes
    edges: EdgeFloor | None = None
    steps: tuple[Step, Step] = (NO_STEP, NO_STEP)

    def spectra(self, flight: Flight) -> tuple[np.ndarray, np.ndarray]:
        """First samples and spectra (blocks, bins, AXES) of a flight's commands as if flown as hard as nominal ones."""
        first, every = block_spectra(flight, self.vehicle)
        return first, every / np.sqrt(self.slopes.level(hardness_of(flight, first, LENGTH)))

    def ratio(self, active: Sequence[Active]) -> np.ndarray:
        """Expected power of the commands over that of nominal flights, (bins, AXES)."""
        row = self._row(active)
        key = row.tobytes()
        kept = self.__dict__.setdefault("_kept", {})
        if key not in kept:
            if len(kept) > 500:
                kept.clear()
            kept[key] = self._power(row) / self._nominal()
        return kept[key]

    def torque_change(self, active: Sequence[Active], f: np.ndarray) -> Change | None:
        """How effects change what the vehicle does upon a logged command; None where they leave the loop as it is.

        A controller no faster than the log folds nothing: there the motors alone count.
        """
        row, changed = self._plant(active)
        if not changed:
            return None
        cache = self.__dict__.setdefault("_changes", {})
        key = row.tobytes(), f.tobytes()
        if key not in cache:
            if len(cache) >= PLANTS:
                cache.clear()
            cache[key] = self._change(row, f)
        return cache[key]

    def _change(self, row: Any, f: np.ndarray) -> Change:
        """`torque_change` of the effects that make a plant row."""
        first = self._plain
        after, before = self._shares(row, f), self._shares(first, f)
        share = after / before if self.by_firmware else np.ones_like(before)
        motors = self._torque(row, AXES[1], f) / self._torque(first, AXES[1], f)
        share /= np.maximum(np.abs(share) / MOST_CHANGE, 1.0)
        return Change(motors[:, None], share[:2], before[:2], np.abs(share[1] - share[2]))

    def changes_loop(self, active: Sequence[Active]) -> bool:
        """Whether effects change the roll and pitch loops."""
        return self._plant(active)[1]

    def same_loop(self, one: Sequence[Active], other: Sequence[Active]) -> bool:
        """Whether the roll and pitch loops are the same under two hypotheses."""
        return _same_loop(self._row(one), self._row(other))

    @cached_property
    def _plain(self) -> Any:
        """Plant row of the vehicle as calibrated."""
        return prepare(self.vehicle, self.calibration)[0][0]

    def _row(self, active: Sequence[Active]) -> Any:
        """Plant row with effects; not to be changed."""
        return self._plant(active)[0]

    def _plant(self, active: Sequence[Active]) -> tuple[Any, bool]:
        """Plant row with effects, and whether they change the roll and pitch loops."""
        cache = self.__dict__.setdefault("_plants", {})
        key = tuple((a.effect.name, *a.values.values()) for a in active)
        if key not in cache:
            if len(cache) >= PLANTS:
                cache.clear()
            row = prepare(self.vehicle, (*self.calibration, *active))[0][0]
            cache[key] = row, not _same_loop(row, self._plain)
        return cache[key]

    def _shares(self, row: Any, f: np.ndarray) -> np.ndarray:
        """Share of the commanded torque that turns the vehicle, complex (3, bins, 3); 1 in yaw.

        Level, stepped, and stepped if the limits of the command cut as much as in nominal flights.
        """
        shares = np.ones((3, len(f), 3), complex)
        for i, axis in enumerate(AXES[1:]):
            shares[:, :, i] = self._of_axis("share", row, axis, f, partial(self._share, row, i + 1, f))
        return shares

    def _share(self, row: Any, i: int, f: np.ndarray, controller: Controller) -> np.ndarray:
        """`_shares` of axis i, complex (3, bins)."""
        usual = self.steps[i - 1]
        step = step_under(usual, controller, self._plain, row)
        each = turnings_per_command(controller, row, AXES[i], self.strengths[i], f, SMOOTH, (NO_STEP, step, usual))
        return np.stack(each) / self._torque(row, AXES[i], f)

    def with_steps(self, told: np.ndarray, over: np.ndarray, f: np.ndarray) -> "ClosedLoop":
        """The same with `steps`, from blocks of nominal flights in which a set-point stepped.

        told (bins, 3): share of the commanded torque that turned the vehicle, 0 where it is not known; over (bins, 3):
        power of these torques over that of other blocks.
        """
        row = self._plain
        roll, pitch = [step_of(firmware(row, axis), row, axis, self.strengths[i], f, over[:, i - 1],
                               told[:, i - 1] * self._torque(row, axis, f))
                       for i, axis in enumerate(AXES) if i] if self.by_firmware else self.steps
        return replace(self, steps=(roll, pitch))

    def _torque(self, row: Any, axis: str, f: np.ndarray) -> np.ndarray:
        """`loop_model.torque_per_command`."""
        return self._of_axis("torque", row, axis, f, lambda controller: torque_per_command(row, axis, f, controller))

    def _of_axis(self, what: str, row: Any, axis: str, f: np.ndarray, make: Callable[[Controller], Any]) -> Any:
        """What a controller makes of an axis at frequencies f; made once for all plant rows with the same loop."""
        by_firmware, *loops = self._loops(row)[AXES.index(axis)]
        # in the torque of a command a controller counts for its period alone
        controller = by_firmware if self.by_firmware or what == "torque" else self.controllers[AXES.index(axis)]
        key = (what, axis, controller, *loops, f.tobytes())
        cache = self.__dict__.setdefault("_axes", {})
        if key not in cache:
            if len(cache) >= LOOPS:
                cache.clear()
            cache[key] = make(controller)
        return cache[key]

    def _loops(self, row: Any) -> list[tuple]:
        """The firmware's controller of each of AXES, and what else a plant row gives its loop."""
        key = row.tobytes()
        cache = self.__dict__.setdefault("_rows", {})
        if key not in cache:
            if len(cache) >= PLANTS:
                cache.clear()
            cache[key] = list(zip(firmware_of(row), (of_loop(row, axis) for axis in AXES), strict=True))
        return cache[key]

    def commands_without(self, flight: Flight, active: Sequence[Active]) -> np.ndarray:
        """Commands (n, 4), N per motor, freed of what the effects did to their spectra."""
        told = commands(flight, self.vehicle)
        ratio = self.ratio(active)
        if np.all(ratio == 1.0):
            return told
        f = np.fft.rfftfreq(len(told), PERIOD_S)
        spectrum = np.fft.rfft(told, axis=0)
        for i in range(len(AXES)):
            spectrum[:, i] /= np.sqrt(np.interp(f, frequencies(), ratio[:, i]))
        return np.fft.irfft(spectrum, len(told), axis=0)

    def _gyro_noise(self) -> np.ndarray:
        return np.maximum(self._plain["gyro_noise"], 1e-9)

    def _nominal(self) -> np.ndarray:
        if "_base" not in self.__dict__:
            self.__dict__["_base"] = self._power(self._plain)
        return self.__dict__["_base"]

    def _power(self, row: Any) -> np.ndarray:
        f = fine_frequencies()
        made = []
        for i, axis in enumerate(AXES):
            sources, beyond = self._of_axis("power", row, axis, f, partial(_power_and_phase, row, axis, f))
            strengths = self.strengths[i].copy()
            if self.by_firmware and axis != "thrust":
                strengths[0] *= (float(row["gyro_noise"][i - 1]) / self._gyro_noise()[i - 1]) ** 2
            power = strengths @ sources
            made.append(power * np.exp(UNSTABLE * beyond) if beyond > 0.0 else power)  # it would not fly
        return np.stack([through_window(m) for m in made], axis=1)


def _power_and_phase(row: Any, axis: str, f: np.ndarray, controller: Controller) -> tuple[np.ndarray, float]:
    return spectra(controller, row, axis, f), excess_phase(controller, row, axis)


def _same_loop(one: Any, two: Any) -> bool:
    """Whether two plant rows have the same roll and pitch loops."""
    return all(np.array_equal(one[k], two[k]) for k in LOOP_FIELDS)


@cache
def frequencies() -> np.ndarray:
    """Hz of the bins that are judged; not to be changed."""
    return _constant(_every()[_kept()])


@cache
def fine_frequencies() -> np.ndarray:
    """FINE points a bin, REACH bins beyond first and last: what a block's window mixes. Not to be changed."""
    f = frequencies()
    step = (f[1] - f[0]) / FINE
    return _constant(f[0] + step * np.arange(-REACH * FINE, (len(f) - 1 + REACH) * FINE + 1))


def through_window(power: np.ndarray) -> np.ndarray:
    """PSD (..., fine points) as blocks under a Hann window show it, (..., bins)."""
    kernel = _window()
    count = (power.shape[-1] - 1) // FINE + 1 - 2 * REACH
    place = np.arange(count)[:, None] * FINE + np.arange(len(kernel))
    return power[..., place] @ kernel


@cache
def _window() -> np.ndarray:
    """What the points around a bin count in it."""
    x = np.arange(-REACH * FINE, REACH * FINE + 1) / FINE
    kernel = (0.5 * np.sinc(x) + 0.25 * (np.sinc(x - 1.0) + np.sinc(x + 1.0))) ** 2
    return _constant(kernel / kernel.sum())


def _constant(values: np.ndarray) -> np.ndarray:
    values.flags.writeable = False
    return values


def _every() -> np.ndarray:
    return np.fft.rfftfreq(LENGTH, PERIOD_S)


def _kept() -> np.ndarray:
    return (_every() >= BAND_HZ[0]) & (_every() <= BAND_HZ[1])


def highpassed(values: np.ndarray) -> np.ndarray:
    """What changes faster than HIGHPASS_HZ, (n,) or (n, c)."""
    low = butter(2, HIGHPASS_HZ * 2.0 * PERIOD_S, output="sos")
    return values - sosfiltfilt(low, values, axis=0, padlen=min(60, len(values) - 2))


def commands(flight: Flight, vehicle: Vehicle) -> np.ndarray:
    """Collective, roll, pitch and yaw commands (n, 4), N per motor, above HIGHPASS_HZ."""
    kept = flight.memory.get("commands")
    if kept is None:
        kept = flight.memory["commands"] = highpassed(vehicle.thrust(flight.pwm) @ MIX.T)
    return kept


def steady(flight: Flight) -> np.ndarray:
    """Samples (n,) of level flight away from edges, take-off and landing."""
    inside = np.isin(flight.phase, STEADY) & (flight.usable | flight.bridged)
    part = np.where(np.isin(flight.phase, STEADY), flight.phase == PLATFORM, 2)
    moves = np.where(flight.phase == KINDS.index("hover"), 0, 1)
    for change, span in ((np.diff(part), EDGE_S), (np.diff(moves), START_S)):
        before, after = (int(x / PERIOD_S) for x in span)
        for k in np.flatnonzero(change) + 1:
            inside[max(k - before, 0):k + after] = False
    return inside


def starts(flight: Flight) -> np.ndarray:
    """First samples of the blocks, half overlapping."""
    bad = np.cumsum(np.concatenate([[0], ~steady(flight)]))
    found, k = [], 0
    while k + LENGTH <= len(flight):
        if bad[k + LENGTH] == bad[k]:
            found.append(k)
            k += LENGTH // 2
        else:
            k += 1
    return np.array(found, int)


def block_spectra(flight: Flight, vehicle: Vehicle) -> tuple[np.ndarray, np.ndarray]:
    """First samples and spectra (blocks, bins, AXES) of the commands, N/sqrt(Hz)."""
    kept = flight.memory.get("command spectra")
    if kept is None:
        first = starts(flight)
        window = np.hanning(LENGTH + 1)[:-1]
        scale = np.sqrt(2.0 * PERIOD_S / (window ** 2).sum())
        told = commands(flight, vehicle)[:, :len(AXES)]
        cut = told[first[:, None] + np.arange(LENGTH)] if len(first) else np.zeros((0, LENGTH, len(AXES)))
        made = np.fft.rfft(cut * window[:, None], axis=1)[:, _kept()] * scale
        calm = _calm(np.abs(made) ** 2)
        kept = flight.memory["command spectra"] = (first[calm], made[calm])
    return kept


def _calm(power: np.ndarray) -> np.ndarray:
    """Blocks (bool) of power (blocks, bins, AXES) like the flight's others: in the rest a set-point stepped."""
    if len(power) < 3:
        return np.ones(len(power), bool)
    usual = np.median(power, axis=0) / np.log(2.0)
    return ((power / np.maximum(usual, 1e-30)).mean(axis=1) < STEPPED).all(axis=1)


def identify(flights: Sequence[Flight], vehicle: Vehicle, calibration: Sequence[Active] = ()) -> ClosedLoop | None:
    """Controller, noise and floor of flights declared nominal; None where they have too few blocks."""
    made = [block_spectra(f, vehicle) for f in flights]
    if sum(len(first) for first, _ in made) < FEWEST:
        return None
    hardness = np.concatenate([hardness_of(f, first, LENGTH) for f, (first, _) in zip(flights, made, strict=True)])
    every = np.abs(np.concatenate([s for _, s in made])) ** 2
    slopes = slopes_of(every, hardness, frequencies())
    power = typical(every / slopes.level(hardness))
    row = prepare(vehicle, calibration)[0][0]
    documented = [noise_strengths(firmware(row, a), row, a, power[:, i]) for i, a in enumerate(AXES)]
    found = [_search(row, a, power[:, i]) for i, a in enumerate(AXES)]
    weight = 0.5 * len(every)
    by_firmware = weight * sum(d[1] for d in documented) < weight * sum(x[1] for x in found) + 1.5 * len(AXES)
    chosen = documented if by_firmware else found
    loop = ClosedLoop(vehicle, tuple(calibration), tuple(c[2] for c in chosen), by_firmware,
                tuple(c[0] for c in chosen), power, len(every), slopes, floor_of(flights, vehicle, calibration))
    model = loop._nominal()
    return replace(loop, floor=model * np.exp(gaussian_filter1d(np.log(power / model), 3.0, axis=0, mode="nearest")))


def typical(power: np.ndarray) -> np.ndarray:
    """Power (bins, AXES) of highest likelihood for that of blocks (blocks, bins, AXES), tails as CommandView has them.

    The mean would follow the few blocks in which a set-point stepped.
    """
    found = power.mean(axis=0)
    for _ in range(12):
        e = power / found
        found = found * ((FREEDOM + 1.0) * e / (FREEDOM + e)).mean(axis=0)
    return found


def noise_strengths(controller: Controller, row: Any, axis: str, power: np.ndarray,
                    steps: int = 300) -> tuple[np.ndarray, float, Controller]:
    """Noise strengths of highest Whittle likelihood for a command's power, its negative a block, and the controller."""
    shapes = through_window(spectra(controller, row, axis, fine_frequencies()))
    scale = power.mean() / shapes.mean(axis=1)
    shapes = shapes * scale[:, None]
    a = np.full(len(shapes), 1.0 / len(shapes))
    for _ in range(steps):  # multiplicative updates for the Itakura-Saito divergence
        model = a @ shapes
        a = np.maximum(a * np.sqrt((shapes @ (power / model ** 2)) / (shapes @ (1.0 / model))), 1e-9)
    e = power / (a @ shapes)
    return a * scale, float((e - np.log(e) - 1.0).sum()), controller


def _search(row: Any, axis: str, power: np.ndarray) -> tuple[np.ndarray, float, Controller]:
    """A cascade's gains found from the shape of the spectrum, near those that vehicles of its size have."""
    usual = firmware(row, axis)
    middle = np.log([usual.gain, usual.angle, max(usual.velocity, 1e-3)])
    spread = np.array([0.7, 0.4, 0.5])
    free = 2 if axis == "thrust" else 3

    def controller(x: np.ndarray) -> Controller:
        values = np.exp(middle + spread * np.concatenate([x, np.zeros(3 - len(x))]))
        return Controller(values[0], values[1], values[2] if free == 3 else 0.0)

    def cost(x: np.ndarray) -> float:
        return 8.0 * noise_strengths(controller(x), row, axis, power, 40)[1] + 0.5 * float(x @ x)

    corners = [np.vstack([[g, *np.zeros(free - 1)], np.eye(free) + [g, *np.zeros(free - 1)]]) for g in (-1.0, 0.5)]
    best = min((minimize(cost, x[0], method="Nelder-Mead", options={
        "initial_simplex": x, "maxfev": 80, "xatol": 0.03, "fatol": 0.02}) for x in corners), key=lambda r: r.fun)
    return noise_strengths(controller(best.x), row, axis, power)


def shapes() -> np.ndarray:
    """Smooth shapes (SHAPES, bins) over the logarithm of frequency: level, slope, slow waves."""
    x = np.log(frequencies())
    x = (x - x[0]) / (x[-1] - x[0])
    return np.array([np.cos(np.pi * k * x) for k in range(SHAPES)])
