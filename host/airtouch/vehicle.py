"""A vehicle: mass, geometry, thrust curve and noise, read from a TOML file."""

import os
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, dataclass, fields
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from airtouch import tables
from airtouch.errors import AirTouchError, printable, unknown
from airtouch.logs.flight_log import FlightLog
from airtouch.parameters import DEFAULT


@dataclass(frozen=True)
class Vehicle:
    """The declared parameters of a nominal vehicle, with SI units in the names.

    thrust_of_pwm_n: (c0, c1, c2), newtons per motor, c0 + c1 p + c2 p^2 for PWM p > 0.
    nominal_voltage_v: battery voltage at which that curve holds; None if unknown.
    Fields with a default are for the simulator and may be left out of a file. 0 in
    thrust_per_speed2, thrust_base_pwm and motor_fall_time_constant_s means "derive it".
    """

    name: str
    mass_kg: float
    arm_m: float
    inertia_kg_m2: tuple[float, float, float]
    thrust_of_pwm_n: tuple[float, float, float]
    yaw_torque_over_thrust_m: float
    motor_time_constant_s: float
    rotor_radius_m: float
    rotor_drag_kg_per_rad: float = 0.0
    acc_noise_rms_mps2: float = 0.06
    gyro_noise_rms_radps: float = 0.006
    range_noise_rms_m: float = 0.002
    gravity_mps2: float = 9.81
    nominal_voltage_v: float | None = None
    voltage_exponent: float = 2.0  #: thrust at a PWM grows with (V / nominal V) to this power
    thrust_per_speed2: float = 0.0  #: N/(rad/s)^2 of one rotor
    rotor_inertia_kg_m2: float = 0.0  #: rotor and propeller
    motor_fall_time_constant_s: float = 0.0  #: time constant of a rotor that slows down
    battery_cells: float = 1.0
    battery_capacity_ah: float = 0.25
    battery_resistance_ohm: float = 0.12
    power_per_thrust15: float = 85.0  #: electrical power over thrust^1.5 of one rotor, W/N^1.5
    acc_noise_ratio: tuple[float, float, float] = (1.0, 1.0, 1.0)  #: noise of each axis relative to the rms above
    gyro_noise_ratio: tuple[float, float, float] = (1.0, 1.0, 1.0)
    range_drift_rms: float = 0.0  #: rms of the down range's drift, as a fraction of the distance
    range_drift_time_s: float = 0.5  #: its correlation time
    gyro_bandwidth_hz: float = 116.0  #: bandwidth of the gyro chip and its noise; 0: no limit
    flow_noise_mps: tuple[float, float] = (0.02, 0.02)  #: rms of the optical flow, forward and left, at 1 m
    flow_noise_time_s: float = 0.05  #: its correlation time
    acc_lowpass_hz: float = 0.0  #: corner of the logged accelerometer's low-pass; 0: none
    thrust_base_pwm: float = 0.0  #: feed-forward of the height controller
    arm_pwm: float = DEFAULT.arm_pwm  #: mean PWM above which the app takes the vehicle to be in the air
    firmware: str = "2026.08"  #: release that flies: a file of simulation/firmwares, or a path to one
    range_module: str = "map"  #: platform, map, none, or firmware: what the release has
    platform: str = ""  #: platform of crazyflie-firmware that flies it (cf2, cf21bl, bolt); "" where unknown

    def thrust(self, pwm: np.ndarray) -> np.ndarray:
        """Thrust of each motor in newtons for PWM of any shape; 0 where PWM <= 0."""
        c0, c1, c2 = self.thrust_of_pwm_n
        pwm = np.asarray(pwm, dtype=np.float64)
        return np.where(pwm > 0, c0 + c1 * pwm + c2 * pwm * pwm, 0.0)


DEFAULT_VEHICLE = "crazyflie-2.1-flow"  #: the authors' drone, flown where nothing names another
FILE = "VEHICLE.toml"  #: in advised commands: the file of a vehicle that is not built in
TEXTS = ("name", "platform", "firmware", "range_module")  #: fields that are texts
#: field -> length, of fields that are lists of numbers
LISTS = {"inertia_kg_m2": 3, "thrust_of_pwm_n": 3, "acc_noise_ratio": 3, "gyro_noise_ratio": 3, "flow_noise_mps": 2}
#: fields that must be more than 0
POSITIVE = {"mass_kg", "arm_m", "motor_time_constant_s", "rotor_radius_m", "gravity_mps2", "nominal_voltage_v",
            "battery_cells", "battery_capacity_ah", "range_drift_time_s", "flow_noise_time_s"}
#: fields that must be 0 or more
NOT_NEGATIVE = {"acc_noise_rms_mps2", "gyro_noise_rms_radps", "range_noise_rms_m", "range_drift_rms", "acc_lowpass_hz",
                "gyro_bandwidth_hz", "acc_noise_ratio", "gyro_noise_ratio", "flow_noise_mps", "rotor_drag_kg_per_rad",
                "voltage_exponent", "thrust_per_speed2", "rotor_inertia_kg_m2", "motor_fall_time_constant_s",
                "battery_resistance_ohm", "power_per_thrust15", "thrust_base_pwm", "arm_pwm"}
FULL_PWM = 65535.0  #: the largest command, 16 bits
RANGE_MODULES = ("map", "platform", "none", "firmware")


def load(name_or_path: str | Path = DEFAULT_VEHICLE) -> Vehicle:
    """A built-in vehicle by name, or the vehicle in a TOML file.

    Raises AirTouchError with the file and the missing or unknown key.
    """
    if not isinstance(name_or_path, (str, Path)):
        raise AirTouchError(f"a vehicle is a name, a .toml file or an object, not {name_or_path!r}")
    path = Path(name_or_path)
    if path.suffix == ".toml":
        try:
            text = path.read_text(encoding="utf-8", errors="replace")
        except (OSError, ValueError):  # ValueError: a name with a zero byte
            raise AirTouchError(f"{printable(str(path), 200)}: no such vehicle file") from None
    else:
        folder = resources.files("airtouch") / "vehicles"
        file = folder / f"{name_or_path}.toml"
        known = sorted(f.name[:-5] for f in folder.iterdir() if f.name.endswith(".toml"))
        if str(name_or_path) not in known:
            raise unknown("vehicle", str(name_or_path), known, ", or a .toml file")
        text = file.read_text(encoding="utf-8")
    return parse(text, str(name_or_path))


def argument_of(vehicle: Vehicle) -> str:
    """What `--vehicle` takes for a vehicle: its name where it is the built-in one of that name, else FILE.

    A shell takes either as it stands.
    """
    try:
        return vehicle.name if load(vehicle.name) == vehicle else FILE
    except AirTouchError:
        return FILE


def of_log(meta: Mapping[str, Any]) -> tuple[Vehicle, str | None]:
    """The vehicle that a log's metadata name, else the default; and a warning where it was assumed.

    It is assumed where the log names none, where no file is known of the one named, and where the reader set it for
    want of a name (`assumed_vehicle`).
    """
    name = str(meta.get("vehicle") or "")
    if unknown_name(meta):
        return load(DEFAULT_VEHICLE), (f"the log names vehicle {name!r}, {why_unknown(name)}; {DEFAULT_VEHICLE} "
                                       "is used, --vehicle names another")
    craft = load(name or DEFAULT_VEHICLE)
    assumed = not name or meta.get("assumed_vehicle") == name
    return craft, f"the log names no vehicle; {craft.name} is assumed, --vehicle names another" if assumed else None


def arm_pwm_of(meta: Mapping[str, Any]) -> float:
    """Mean PWM above which the vehicle that a log's metadata name flies; that of `of_log` where they name no known one.
    """
    return of_log(meta)[0].arm_pwm


def of_logs(logs: Iterable[FlightLog]) -> tuple[Vehicle, str | None]:
    """The vehicle of flights of one vehicle: `of_log` of the first of them.

    Raises AirTouchError where two logs name different vehicles.
    """
    first: Mapping[str, Any] | None = None
    named: dict[str, str] = {}
    for log in logs:
        first = log.meta if first is None else first
        if name := name_in(log.meta):
            named.setdefault(name, log.source)
    if len(named) > 1:
        pairs = [f"{name} flew {source}" for name, source in list(named.items())[:2]]
        raise AirTouchError(f"two vehicles: {', '.join(pairs)}; give flights of one, or --vehicle for all of them")
    return of_log(first or {})


def name_in(meta: Mapping[str, Any]) -> str:
    """The vehicle that a log's metadata name, "" for none; a name that the reader assumed is none."""
    name = str(meta.get("vehicle") or "")
    return name if meta.get("assumed_vehicle") != name else ""


def other_baseline(flights: Iterable[str], baseline: Iterable[str]) -> list[str]:
    """A note where baseline flights name a vehicle that none of the flights names; names as `name_in` gives them."""
    named = sorted(set(flights) - {""})
    others = sorted(set(baseline) - {"", *named})
    return [f"the baseline names vehicle {', '.join(others)}, the flights {', '.join(named)}: what differs may be the "
            "vehicles; take a baseline of the same one"] if named and others else []


def unknown_name(meta: Mapping[str, Any]) -> str:
    """The vehicle that a log's metadata name where it cannot be loaded (`why_unknown`), else ""."""
    name = str(meta.get("vehicle") or "")
    try:
        load(name or DEFAULT_VEHICLE)
    except AirTouchError:
        return name
    return ""


def why_unknown(name: str) -> str:
    """What is wrong with a name that `unknown_name` gave: no file is known of it, or what is wrong in its file."""
    if name.endswith(".toml") and os.path.isfile(name):
        try:
            load(name)
        except AirTouchError as error:
            return f"whose file is wrong ({error})"
    return "of which no file is known"


def parse(text: str, source: str) -> Vehicle:
    """The vehicle in a TOML text. `source` is its name in messages. Raises AirTouchError as `load` does."""
    table = tables.parse(text, source)
    values = numbers(table, source)
    try:
        vehicle = Vehicle(**values)
    except TypeError:
        required = [f.name for f in fields(Vehicle) if f.default is MISSING and f.name not in values]
        raise AirTouchError(f"{source}: missing {', '.join(required)}") from None
    check_firmware(vehicle.firmware, vehicle.range_module, source)
    return vehicle


def numbers(table: Mapping[str, Any], source: str) -> dict[str, Any]:
    """The fields of a vehicle in a TOML table, as keywords of `Vehicle`.

    Raises AirTouchError for an unknown name and a wrong value.
    """
    known = [f.name for f in fields(Vehicle)]
    unknown_keys = sorted(set(table) - set(known))
    if unknown_keys:
        raise AirTouchError(f"{source}: unknown key {', '.join(unknown_keys)}; known: {', '.join(known)}")
    values: dict[str, Any] = {}
    for name, value in table.items():
        if name in LISTS:
            values[name] = tables.number_list(table, name, source, LISTS[name])
            for one in values[name] if name in NOT_NEGATIVE else ():
                tables.number({name: one}, name, source, 0.0)
        elif name in TEXTS:
            if not isinstance(value, str):
                raise AirTouchError(f"{source}: {name} must be a text in quotes")
            values[name] = value
        else:
            values[name] = tables.number(table, name, source, 0.0 if name in NOT_NEGATIVE else -np.inf,
                                         above=0.0 if name in POSITIVE else -np.inf)
    if min(values.get("inertia_kg_m2", (1.0,))) <= 0:
        raise AirTouchError(f"{source}: inertia must be positive")
    c0, c1, c2 = values.get("thrust_of_pwm_n", (0.0, 1.0, 0.0))
    if c0 + (c1 + c2 * FULL_PWM) * FULL_PWM <= 0.0 or c1 + 2.0 * c2 * FULL_PWM <= 0.0:
        raise AirTouchError(f"{source}: thrust_of_pwm_n must give a thrust at PWM {FULL_PWM:.0f} that is positive and "
                            "grows with PWM")
    return values


def check_firmware(firmware: str, range_module: str, source: str) -> None:
    """Raise AirTouchError for an unknown firmware or range module. `source` is the file's name in messages."""
    from airtouch.simulation.firmware import settings

    if range_module not in RANGE_MODULES:
        raise AirTouchError(f"{source}: range_module is one of {', '.join(RANGE_MODULES)}, not {range_module!r}")
    try:
        settings.load(firmware)
    except AirTouchError as error:
        raise AirTouchError(f"{source}: {error}") from None
