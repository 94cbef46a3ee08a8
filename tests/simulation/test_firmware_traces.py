"""The firmware's loop against numbers that the real firmware printed, compiled as plain C.

Inputs and outputs are in ../shared/firmware; its SOURCE.md says how they were made and how far single precision
moves them. Tolerances here are five times that.
"""

import csv
import gzip
import math
from pathlib import Path

import numpy as np
import pytest

from airtouch import vehicle as vehicles
from airtouch.simulation.firmware import controller, estimator, kalman, mixer, range_module, settings
from airtouch.simulation.plant import from_vehicle

FOLDER = Path(__file__).parents[3] / "shared" / "firmware"
pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason="no traces of the firmware in ../shared/firmware")
G = 9.81


def trace(name):
    """The columns of a trace, {name: (rows,)}; event is text, an empty cell NaN."""
    with gzip.open(FOLDER / f"{name}.csv.gz", "rt") as file:
        rows = list(csv.DictReader(file))
    return {key: np.array([r[key] if key == "event" else float(np.float32(r[key] or "nan")) for r in rows])
            for key in rows[0]}


@pytest.mark.parametrize("name", ["step", "cruise", "turning"])
def test_the_estimator_follows_the_firmwares_trace(name):
    t = trace(f"estimator_{name}")
    plant, est = from_vehicle(vehicles.load("crazyflie-2.1"))[0], np.zeros(1, kalman.STATE)[0]
    plant["firmware"], plant["gravity"] = settings.load("2026.08")[0], G
    kalman.begin(plant["firmware"], est, 0.0, 0.0, 0.0, np.array([1.0, 0.0, 0.0, 0.0]))
    rows = {int(tick): i for i, tick in enumerate(t["tick_ms"])}
    assert len(rows) == len(t["tick_ms"])
    # one IMU sample holds for ten ticks: a P row has that of the ten before, an F row that of the running ones
    blocks = {int(tick) // 10 - (t["event"][i] == "P"): i for tick, i in rows.items() if t["event"][i] != "T"}
    acc = np.stack([t[f"acc_{a}_g"] for a in "xyz"], axis=1) * G
    gyro = np.radians(np.stack([t[f"gyro_{a}_dps"] for a in "xyz"], axis=1))
    estimates = np.full((len(rows), 19), np.nan)
    reading = np.zeros(1, estimator.READING)[0]
    flying = False
    for tick in range(max(rows) + 1):  # what the simulator's loop calls at every tick
        i = rows.get(tick)
        event = t["event"][i] if i is not None else ""
        assert (event == "P") == (tick > 0 and tick % 10 == 0)
        reading["distance"] = reading["forward"] = np.nan
        if event == "P":
            flying = bool(t["flying"][i])
        if event == "T":
            reading["distance"], reading["distance_std"] = t["tof_m"][i], t["tof_std_m"][i]
        if event == "F":
            reading["forward"], reading["left"], reading["dt"], reading["std"] = (
                t["flow_dx"][i], t["flow_dy"][i], t["flow_dt_s"][i], t["flow_std"][i])
        reading["acc"], reading["gyro"] = acc[blocks[tick // 10]], gyro[blocks[tick // 10]]
        estimator.tick(plant, est, tick, flying, reading)
        if i is not None:
            estimates[i] = [*est["x"], *est["v"], *est["q"], *np.diag(est["p"])]
    names = ["x_m", "y_m", "z_m", *(f"v{a}_body_mps" for a in "xyz"), *(f"q{a}" for a in "wxyz")]
    truth = np.stack([t[n] for n in names], axis=1)
    np.testing.assert_allclose(estimates[:, :10], truth, rtol=0, atol=1e-4)
    variances = [f"var_{a}" for a in ("x", "y", "z", "vx", "vy", "vz", "roll", "pitch", "yaw")]
    np.testing.assert_allclose(estimates[:, 10:], np.stack([t[n] for n in variances], axis=1), rtol=2e-3, atol=0)


@pytest.mark.parametrize(("name", "firmware"), [
    ("position", "2026.08"), ("velocity", "2026.08"), ("attitude", "2026.08"), ("saturation", "2026.08"),
    ("fork_position", "authors-2024-01"), ("fork_velocity", "authors-2024-01")])
def test_the_controller_and_mixer_follow_the_firmwares_trace(name, firmware):
    t = trace(f"controller_{name}")
    release, plant = settings.load(firmware)[0], from_vehicle(vehicles.load("crazyflie-2.1"))[0]
    state, setpoints = np.zeros(1, controller.STATE)[0], np.zeros(1, controller.SETPOINT)
    for name in ("thrust_base", "thrust_min", "thrust_scale"):  # the firmware's own, not scaled to a vehicle
        plant[name] = release["controller"][name]
    plant["rate_scale"] = 1.0
    plant["firmware"] = release
    s, estimate = setpoints[0], np.zeros(1, controller.ESTIMATE)[0]

    def columns(*names):
        return np.stack([t[n] for n in names], axis=1)

    modes = columns(*(f"mode_{a}" for a in ("x", "y", "z", "roll", "pitch", "yaw")))
    sp_position, sp_velocity = columns(*(f"sp_{a}_m" for a in "xyz")), columns(*(f"sp_v{a}_mps" for a in "xyz"))
    sp_attitude = columns(*(f"sp_{a}_deg" for a in ("roll", "pitch", "yaw")))
    sp_rate = columns(*(f"sp_{a}rate_dps" for a in ("roll", "pitch", "yaw")))
    position, velocity = columns("x_m", "y_m", "z_m"), columns("vx_mps", "vy_mps", "vz_mps")
    attitude = columns("roll_deg", "pitch_deg", "yaw_deg")
    gyro = columns("gyro_x_dps", "gyro_y_dps", "gyro_z_dps")
    desired, commands, motors = np.zeros((len(gyro), 6)), np.zeros((len(gyro), 4)), np.zeros((len(gyro), 8))
    for i, tick in enumerate(t["tick_ms"].astype(int)):
        s["mode"], s["velocity_body"], s["thrust"] = modes[i], t["velocity_body"][i], t["sp_thrust"][i]
        s["position"], s["velocity"], s["attitude"], s["rate"] = (
            sp_position[i], sp_velocity[i], sp_attitude[i], sp_rate[i])
        estimate["position"], estimate["velocity"] = position[i], velocity[i]
        estimate["attitude"], estimate["rate"] = attitude[i], gyro[i]
        controller.run(plant, state, s, estimate, tick)
        desired[i] = [*state["attitude"], *state["rate"]]
        commands[i] = [state["thrust"], *state["command"]]
        pwm = np.zeros(4)
        mixer.mix(*commands[i], pwm)
        motors[i, :4] = pwm
        mixer.cap(pwm)
        motors[i, 4:] = pwm
    traced = columns(*(f"des_{a}_deg" for a in ("roll", "pitch", "yaw")),
                     *(f"des_{a}rate_dps" for a in ("roll", "pitch", "yaw")))
    np.testing.assert_allclose(desired, traced, rtol=0, atol=0.05)
    np.testing.assert_allclose(commands, columns("out_thrust", "out_roll", "out_pitch", "out_yaw"), rtol=0, atol=15)
    expected = columns(*(f"m{k}_uncapped" for k in range(1, 5)), *(f"m{k}_pwm" for k in range(1, 5)))
    np.testing.assert_allclose(motors, expected, rtol=0, atol=15)


HEAD = {"threshold_m": 0.30, "height_m": 0.70}  #: in force from 2024-06-26


@pytest.mark.parametrize("case", ["exact", "low", "off", "soft", "drift", "slow", "fast"])
@pytest.mark.parametrize("release", ["jan", "head"])
def test_the_range_module_follows_the_firmwares_trace(release, case):
    t = trace(f"authors_range_{release}_{case}")
    firmware, state = settings.load("authors-2024-01")[0], np.zeros(1, range_module.STATE)[0]
    if release == "head":
        for key, value in HEAD.items():
            firmware["range_module"][key] = value
    for i, raw in enumerate(t["raw_m"]):
        height = range_module.platform(firmware, state, raw)
        assert height == pytest.approx(t["enqueued_m"][i], abs=1e-6)
        assert state["over"] == t["over_platform"][i]
        assert state["held"] == pytest.approx(t["held_height_m"][i], abs=1e-6)
        assert state["reference"] == pytest.approx(t["reference_m"][i], abs=1e-6)
    assert math.isfinite(height)
