"""What a release of the firmware is made of, as one record that compiled code reads by name.

A firmware is a TOML file in `simulation/firmwares`; `base = "..."` takes everything it does not say from
another one. Every key is in KEYS, with its meaning and unit.
"""

import difflib
import functools
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from airtouch import tables
from airtouch.errors import AirTouchError

DEFAULT = "2026.08"
STEP_MS = 2  #: the controller is looked at this often: the physics step
LOG_MS = 10  #: set-points change and rows are logged this often
LOOPS = ("rate_roll", "rate_pitch", "rate_yaw", "roll", "pitch", "yaw", "velocity_x", "velocity_y",
         "velocity_z", "position_x", "position_y", "position_z")
(RATE_ROLL, RATE_PITCH, RATE_YAW, ROLL, PITCH, YAW, VELOCITY_X, VELOCITY_Y, VELOCITY_Z, POSITION_X,
 POSITION_Y, POSITION_Z) = range(12)
RANGE_MODULES = ("none", "platform", "map")
FLAGS = (0, 1)  #: values of what is on or off
MOST_BASES = 20  #: firmware files that name one another; more is a circle or a mistake
OWN_MODULE = "firmware"  #: of a vehicle or scenario: the range module that its firmware has
COMPENSATIONS = ("none", "quadratic", "cubic", "vehicle")
(NO_MODULE, PLATFORM, MAP), (NO_COMPENSATION, QUADRATIC, CUBIC, OF_VEHICLE) = range(3), range(4)

_F, _I = np.float64, np.int64
GAINS = np.dtype([("p", _F), ("i", _F), ("d", _F), ("integral_limit", _F), ("output_limit", _F)])
#: section -> key -> (type, names or FLAGS to choose from, or (number of values,), or None; meaning)
KEYS: dict[str, dict[str, tuple[Any, tuple[Any, ...] | None, str]]] = {
    "periods": {
        "attitude_ms": (_I, None, "of the attitude and rate loops; a multiple of 2"),
        "position_ms": (_I, None, "of the position and velocity loops; a multiple of attitude_ms"),
        "prediction_ms": (_I, None, "of the estimator's prediction"),
        "range_ms": (_I, None, "of the down range's readings"),
        "flow_ms": (_I, None, "of the optical flow's readings")},
    "controller": {
        "derivative_on_error": (_I, FLAGS, "1: derivatives act on the error, 0: on the measurement"),
        "reset_on_mode_change": (_I, FLAGS, "1: a set-point of another mode resets all loops"),
        "reset_in_rate_mode": (_I, FLAGS, "1: roll and pitch in rate mode reset their angle loops"),
        "thrust_base": (_F, None, "command in hover, of 65535"),
        "thrust_min": (_F, None, "least command in flight, of 65535"),
        "thrust_scale": (_F, None, "command per unit of the climb loop's output"),
        "tilt_limit_deg": (_F, None, "most roll and pitch that the velocity loops ask for")},
    "filters": {
        "acc_hz": (_F, None, "second-order low-pass of the accelerometer at 1 kHz"),
        "gyro_hz": (_F, None, "second-order low-pass of the gyro at 1 kHz")},
    "kalman": {
        "std_xy_m": (_F, None, "initial standard deviation of x and y"),
        "std_z_m": (_F, None, "of z"),
        "std_velocity_mps": (_F, None, "of the velocities"),
        "std_attitude_rad": (_F, None, "of the attitude"),
        "noise_acc_xy_mps2": (_F, None, "process noise, horizontal"),
        "noise_acc_z_mps2": (_F, None, "process noise, vertical"),
        "noise_gyro_radps": (_F, None, "process noise of the attitude"),
        "reversion": (_F, None, "share by which each prediction on the ground levels the attitude"),
        "most_position_m": (_F, None, "beyond it the estimate starts anew"),
        "most_velocity_mps": (_F, None, "beyond it the estimate starts anew")},
    "range": {
        "std_m": (_F, None, "standard deviation of a near reading"),
        "std_far_m": (_F, None, "twice std_m is reached here"),
        "std_growth_1pm": (_F, None, "rate at which it grows with the distance, 1/m"),
        "most_m": (_F, None, "readings from here on are dropped"),
        "cone_deg": (_F, None, "half angle of the cone whose nearest point is measured")},
    "flow": {
        "std_counts": (_F, None, "standard deviation of a reading"),
        "most_counts": (_F, None, "readings of so many counts and more are dropped"),
        "counts_per_pixel": (_F, None, "counts of a pixel"),
        "pixels": (_F, None, "of the picture"),
        "aperture_rad": (_F, None, "of the picture"),
        "least_height_m": (_F, None, "least height that the model divides by")},
    "range_module": {
        "kind": (_I, RANGE_MODULES, "none; platform: a fixed height is added after a large drop; "
                                    "map: the true height of what is below is added"),
        "threshold_m": (_F, None, "a drop by more sets the flag, a rise by more clears it"),
        "height_m": (_F, None, "what is added while the flag is set"),
        "step_m": (_F, None, "a reading that differs more from the last one passed is held back"),
        "every": (_I, None, "readings between two renewals of the reference")},
    "battery_compensation": {
        "kind": (_I, COMPENSATIONS, "none; quadratic: volts of grams; cubic: thrust of volts; "
                                    "vehicle: the vehicle's own thrust curve"),
        "most_n": (_F, None, "thrust of one motor at the full command (cubic)"),
        "least_n": (_F, None, "less than this turns a motor off (cubic)"),
        "newtons_of_volts": (_F, (4,), "coefficients of the cubic, constant first"),
        "most_g": (_F, None, "thrust of all four at the full command (quadratic)"),
        "volts_of_grams": (_F, (2,), "linear and quadratic coefficient"),
        "voltage_share": (_F, None, "of a new voltage that enters each millisecond; 1: no filter"),
        "least_v": (_F, None, "below it the motors stop")},
}


def _field(kind: Any, choices: Any) -> tuple:
    return (kind, choices) if choices and len(choices) == 1 else (kind,)


DTYPE = np.dtype([("loops", GAINS, (len(LOOPS),))] + [
    (section, [(key, *_field(kind, choices)) for key, (kind, choices, _) in keys.items()])
    for section, keys in KEYS.items()])


def names() -> list[str]:
    """Names of the package's firmwares."""
    folder = resources.files("airtouch") / "simulation" / "firmwares"
    return sorted(f.name[:-5] for f in folder.iterdir() if f.name.endswith(".toml"))


_names = functools.cache(names)


def load(name_or_path: str | Path = DEFAULT, depth: int = 0) -> np.ndarray:
    """The settings (1,) of DTYPE of a firmware by name, or of a TOML file by path.

    depth: number of files that name this one as their base. Raises AirTouchError that names the nearest known
    firmware, or the wrong key.
    """
    name = str(name_or_path)
    if name.endswith(".toml"):
        if not Path(name).is_file():
            raise AirTouchError(f"{name}: no such firmware file")
        return parse(Path(name).read_text(encoding="utf-8", errors="replace"), name, depth)
    if name not in _names():
        near = difflib.get_close_matches(name, _names(), 3, 0.3)
        hint = f"did you mean {' or '.join(near)}?" if near else f"known: {', '.join(names())}"
        raise AirTouchError(f"no firmware {name!r}; {hint} A path to a .toml file works too")
    # as bytes: NumPy copies a record field by field, forty times as slow
    return np.frombuffer(bytearray(_built_in(name).tobytes()), DTYPE)


@functools.cache
def _built_in(name: str) -> np.ndarray:
    text = (resources.files("airtouch") / "simulation" / "firmwares" / f"{name}.toml").read_text(encoding="utf-8")
    return parse(text, name)


def parse(text: str, source: str, depth: int = 0) -> np.ndarray:
    """Settings (1,) from TOML text; `source`, its path or name, names it in messages. depth: as of `load`.

    A base that ends in .toml is a file beside `source`, unless its path is absolute.
    """
    table = tables.parse(text, source)
    base = table.pop("base", None)
    table.pop("summary", None)
    if base is not None and not (isinstance(base, str) and base != source):
        raise AirTouchError(f"{source}: base must name another firmware")
    if depth > MOST_BASES:
        raise AirTouchError(f"{source}: more than {MOST_BASES} firmware files name one another as their base")
    if base and base.endswith(".toml"):
        base = str(Path(source).parent / base)
    rows = load(base, depth + 1) if base else np.zeros(1, DTYPE)
    unknown = sorted(set(table) - set(KEYS) - {"loops"})
    if unknown:
        raise AirTouchError(f"{source}: unknown section {', '.join(unknown)}; known: loops, {', '.join(KEYS)}")
    row = rows[0]
    for section, keys in table.items():
        if not isinstance(keys, Mapping):
            raise AirTouchError(f"{source}: [{section}] must be a table")
        for key, value in keys.items():
            if section == "loops":
                _loop(row["loops"], key, value, source)
            else:
                _value(row[section], section, key, value, source)
    if base is None:
        missing = [s for s in ("loops", *KEYS) if s not in table]
        missing += [f"{s}.{k}" for s in KEYS if s in table for k in set(KEYS[s]) - set(table[s])]
        missing += [f"loops.{k}" for k in LOOPS if k not in table.get("loops", {})]
        if missing:
            raise AirTouchError(f"{source}: missing {', '.join(sorted(missing))} (or a base)")
    _check(row, source)
    return rows


def _loop(loops: np.ndarray, key: str, value: Any, source: str) -> None:
    if key not in LOOPS:
        raise AirTouchError(f"{source}: no loop {key!r}; known: {', '.join(LOOPS)}")
    if not isinstance(value, Mapping) or set(value) - set(GAINS.names or ()):
        raise AirTouchError(f"{source}: loops.{key} takes {', '.join(GAINS.names or ())}")
    for name, number in value.items():
        if not _is_number(number):
            raise AirTouchError(f"{source}: loops.{key}.{name} must be a number")
        loops[LOOPS.index(key)][name] = number


def _value(row: Any, section: str, key: str, value: Any, source: str) -> None:
    if key not in KEYS[section]:
        raise AirTouchError(f"{source}: [{section}] has no {key}; it has {', '.join(KEYS[section])}")
    kind, choices, _ = KEYS[section][key]
    if choices and len(choices) > 1:
        if value not in choices:
            raise AirTouchError(f"{source}: {section}.{key} is one of {', '.join(map(str, choices))}, not {value!r}")
        row[key] = choices.index(value)
    elif choices:
        if not (isinstance(value, list) and len(value) == choices[0] and all(map(_is_number, value))):
            raise AirTouchError(f"{source}: {section}.{key} must be {choices[0]} numbers")
        row[key] = value
    elif not _is_number(value):
        raise AirTouchError(f"{source}: {section}.{key} must be a number")
    elif kind is _I and not (value == int(value) and abs(value) < 2**31):
        raise AirTouchError(f"{source}: {section}.{key} = {value:g} must be a whole number, less than 2^31")
    else:
        row[key] = value


def _check(row: Any, source: str) -> None:
    periods = row["periods"]
    for key in KEYS["periods"]:
        if periods[key] < 1:
            raise AirTouchError(f"{source}: periods.{key} must be a whole number of milliseconds, 1 or more")
    if periods["attitude_ms"] % STEP_MS or periods["position_ms"] % periods["attitude_ms"]:
        raise AirTouchError(f"{source}: periods.attitude_ms must be a multiple of {STEP_MS}, position_ms of it")
    for section, key in (("range", "std_m"), ("flow", "std_counts"), ("flow", "least_height_m"),
                         ("flow", "aperture_rad"), ("flow", "counts_per_pixel"), ("range_module", "every"),
                         ("controller", "thrust_scale"), ("filters", "acc_hz"), ("filters", "gyro_hz")):
        if not row[section][key] > 0:
            raise AirTouchError(f"{source}: {section}.{key} must be positive")
    if not 0.0 < row["battery_compensation"]["voltage_share"] <= 1.0:
        raise AirTouchError(f"{source}: battery_compensation.voltage_share must be more than 0 and at most 1")


def _is_number(value: object) -> bool:
    return isinstance(value, bool) or tables.is_number(value)
