"""Flights of other people's simulators: a manifest names the effect in each; two more of each vehicle have none."""

import csv
import json
from pathlib import Path

Row = dict[str, str]  #: of the manifest: file, vehicle, effect, strength, unit and, where it is there, detail
#: the manifest's name of an effect -> the registry's, where they differ
NAMES = {"latency": "sensor_latency", "act_delay": "actuator_delay", "thrust_coeff": "thrust_coefficient"}
#: effect, by the registry's name -> the parameter of the registry that a manifest's strength is, and its unit there.
#: Strengths of the others are of laws that the registry does not have, or are products with an unknown drag
STRENGTHS = {
    "actuator_delay": ("delay", 0.001), "controller_gain": ("rate", 1.0), "imu_noise": ("factor", 1.0),
    "inertia": ("fraction", 1.0), "mass": ("fraction", 1.0), "motor_lag": ("factor", 1.0),
    "motor_noise": ("rms", 1.0), "packet_loss": ("share", 1.0), "sensor_latency": ("delay", 0.001),
    "thrust_coefficient": ("loss", 1.0), "time_jitter": ("rms", 0.001), "weak_motor": ("thrust_loss", 1.0),
}
#: the same of directions, which only a manifest with a column `detail` has: its name there, the parameters
DIRECTIONS = {"com_m": ("x", "y"), "acc_bias": ("acc_x", "acc_y", "acc_z"), "gyro_bias": ("gyro_x", "gyro_y", "gyro_z")}


def labelled(folder: Path) -> list[Row]:
    """Rows of the flights with an effect."""
    return [r for r in csv.DictReader((folder / "manifest.csv").open()) if not r["file"].startswith("cal")]


def truth(row: Row) -> str:
    """The registry's name of the effect in a flight."""
    return NAMES.get(row["effect"], row["effect"])


def vehicle_file(folder: Path, row: Row) -> Path:
    """The file of a flight's vehicle."""
    return folder / f"vehicle_{row['vehicle'].lower()}.toml"


def baseline(folder: Path, row: Row) -> list[Path]:
    """The two flights without an effect of a flight's vehicle."""
    return [folder / f"cal_{row['vehicle']}_{i}.csv.gz" for i in (0, 1)]


def true_parameters(row: Row) -> dict[str, float]:
    """Parameters of a flight's effect by name, in the registry's units, as far as the manifest has them."""
    out = {}
    if truth(row) in STRENGTHS:
        name, unit = STRENGTHS[truth(row)]
        out[name] = unit * float(row["strength"])
    for key, values in json.loads(row.get("detail") or "{}").items():
        if key == "motor":
            out["rotor"] = float(values.removeprefix("m"))
        out |= dict(zip(DIRECTIONS.get(key, ()), values, strict=False))  # a z of 0 beside x and y is no parameter
    return out
