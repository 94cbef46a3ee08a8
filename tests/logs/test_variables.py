"""Crazyflie log variables as columns: units by hand, axes by SciPy's rotations."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from airtouch.logs import true_edges
from airtouch.logs.flight_log import FlightLog
from airtouch.logs.variables import to_columns

G = 9.81  #: m/s^2, as the firmware has it


def converted(**table):
    """Columns and metadata of log variables; "stateEstimate__vx" stands for "stateEstimate.vx"."""
    meta = {"warnings": []}
    return to_columns({name.replace("__", "."): np.asarray(v, float) for name, v in table.items()}, meta), meta


def attitude(seed=0, n=40):
    """A smooth attitude: angles (n, 3) rad, and the logged roll, legacy pitch and yaw in degrees."""
    angles = np.random.default_rng(seed).normal(0, 0.02, (n, 3)).cumsum(axis=0)
    degrees = np.degrees(angles)
    return angles, {"stateEstimate__roll": degrees[:, 0], "stateEstimate__pitch": -degrees[:, 1],
                    "stateEstimate__yaw": degrees[:, 2]}


def test_log_variables_are_converted_to_si_units():
    columns, meta = converted(acc__x=[1], acc__y=[0], acc__z=[-1], gyro__x=[180], gyro__y=[0], gyro__z=[-90],
                              stateEstimateZ__vx=[300], stateEstimateZ__vy=[0], stateEstimateZ__vz=[-20],
                              pm__vbatMV=[3700], range__zrange=[400], motor__m1=[1], motor__m2=[2], motor__m3=[3],
                              motor__m4=[65535])
    assert [columns[f"acc_{a}_mps2"][0] for a in "xyz"] == pytest.approx([G, 0, -G], rel=1e-3)
    assert [columns[f"gyro_{a}_radps"][0] for a in "xyz"] == pytest.approx([np.pi, 0, -np.pi / 2])
    assert [columns[f"v{a}_mps"][0] for a in "xyz"] == pytest.approx([0.3, 0, -0.02])
    assert columns["vbat_V"][0] == pytest.approx(3.7) and columns["zrange_m"][0] == pytest.approx(0.4)
    assert [columns[f"m{i}_pwm"][0] for i in (1, 2, 3, 4)] == [1, 2, 3, 65535]
    assert meta == {"warnings": [], "acc_frame": "body"}


def test_of_two_variables_for_a_column_the_whole_one_is_taken():
    both, _ = converted(pwm__m1_pwm=[7], motor__m1=[1], motor__m2=[2], motor__m3=[3], motor__m4=[4])
    assert [both[f"m{i}_pwm"][0] for i in (1, 2, 3, 4)] == [1, 2, 3, 4]  # three of pwm.m*_pwm are missing
    volts, _ = converted(pm__vbat=[3.9], pm__vbatMV=[3700])
    assert volts["vbat_V"][0] == 3.9


def test_an_axis_is_converted_without_the_others_of_its_group():
    """A uSD configuration that logs what a hover needs lost it all, without a warning."""
    columns, meta = converted(acc__z=[1], stateEstimate__vx=[0.1], stateEstimate__vy=[0.2], stateEstimateZ__z=[800],
                              gyro__xRaw=[32.768])
    assert {name: values[0] for name, values in columns.items()} == pytest.approx({
        "acc_z_mps2": G, "vx_mps": 0.1, "vy_mps": 0.2, "z_m": 0.8, "gyro_x_radps": np.radians(2.0)})
    assert meta == {"warnings": [], "acc_frame": "body"}


def test_axes_of_one_column_group_may_come_from_two():
    """The height alone was left, and the two others were lost without a warning."""
    columns, meta = converted(stateEstimate__z=[3], stateEstimateZ__x=[1000], stateEstimateZ__y=[2000])
    assert [columns[f"{a}_m"][0] for a in "xyz"] == [1, 2, 3] and not meta["warnings"]


def test_an_axis_that_others_replace_is_named():
    columns, meta = converted(acc__z=[1], stateEstimate__ax=[0.1], stateEstimate__ay=[0.2], stateEstimate__az=[0.3])
    assert columns["acc_z_mps2"][0] == pytest.approx(1.3 * G) and meta["acc_frame"] == "world"
    assert [w for w in meta["warnings"] if "acc.z" in w] == ["acc.z left out: other variables give acc_z_mps2"]


def test_a_whole_group_is_taken_before_an_axis_of_another():
    both, _ = converted(stateEstimate__x=[7], stateEstimateZ__x=[1000], stateEstimateZ__y=[2000],
                        stateEstimateZ__z=[3000])
    assert [both[f"{a}_m"][0] for a in "xyz"] == [1, 2, 3]


@pytest.mark.parametrize("logged", ["motor.m1", "rpm.m3", "stateEstimate.az", "stateEstimate.qw",
                                    "stateEstimateZ.rateRoll"])
def test_variables_that_need_the_others_of_their_group_are_named(logged):
    columns, meta = converted(**{logged.replace(".", "__"): [1.0], "gyro__x": [0], "gyro__y": [0], "gyro__z": [0]})
    assert list(columns) == ["gyro_x_radps", "gyro_y_radps", "gyro_z_radps"]
    assert len(meta["warnings"]) == 1 and meta["warnings"][0].startswith(f"{logged} left out, as ")


def test_a_range_of_zero_is_near_below_and_no_answer_to_the_side():
    columns, _ = converted(range__zrange=[0, 400, 32767], range__front=[0, 400, 32767])
    assert np.array_equal(columns["zrange_m"], [0, 0.4, np.nan], equal_nan=True)
    assert np.array_equal(columns["range_front_m"], [np.nan, 0.4, np.nan], equal_nan=True)


@pytest.mark.parametrize("outlier_mm", [5000, 8191, 65535])  # zranger2.c: "outliers typically occur as >8 [m]"
def test_a_down_range_that_the_firmware_rejects_is_no_edge(outlier_mm):
    n = 1000
    millimetres = np.full(n, 800.0)
    millimetres[500:540] = outlier_mm
    motors = {f"motor__m{i}": 40000 + np.arange(n) % 7 for i in (1, 2, 3, 4)}
    columns, _ = converted(range__zrange=millimetres, **motors)
    log = FlightLog({"t_s": 0.01 * np.arange(n), **columns}, {"source": "x", "format": "usd", "warnings": []})
    assert np.isnan(log["zrange_m"][500:540]).all() and np.isfinite(log["zrange_m"]).sum() == n - 40
    assert true_edges(log) == []


def test_accelerations_of_the_estimate_turn_into_the_body():
    angles, table = attitude()
    world = np.random.default_rng(1).normal(0, 0.3, (len(angles), 3))  # g, without gravity
    columns, meta = converted(**table, **{f"stateEstimate__a{a}": world[:, i] for i, a in enumerate("xyz")})
    body = Rotation.from_euler("ZYX", angles[:, ::-1]).inv().apply((world + (0, 0, 1)) * G)
    np.testing.assert_allclose(np.column_stack([columns[f"acc_{a}_mps2"] for a in "xyz"]), body, rtol=1e-3, atol=1e-3)
    assert meta["acc_frame"] == "body"


def test_without_attitude_they_stay_in_the_world_and_say_so():
    columns, meta = converted(stateEstimateZ__ax=[0], stateEstimateZ__ay=[100], stateEstimateZ__az=[9810])
    assert [columns[f"acc_{a}_mps2"][0] for a in "xyz"] == pytest.approx([0, 0.1, 9.81])
    assert meta["acc_frame"] == "world" and "world frame" in meta["warnings"][0]


@pytest.mark.parametrize("sign", [1.0, -1.0])  # firmware releases differ
def test_the_pitch_rate_gets_the_sign_of_the_logged_attitude(sign):
    angles, table = attitude(seed=2)
    turns = Rotation.from_euler("ZYX", angles[:, ::-1])
    rates = np.vstack([np.zeros(3), (turns[:-1].inv() * turns[1:]).as_rotvec()]) / 0.01  # rad/s in the body
    mrad = 1e3 * rates * (1.0, sign, 1.0)
    columns, meta = converted(**table, stateEstimateZ__rateRoll=mrad[:, 0], stateEstimateZ__ratePitch=mrad[:, 1],
                              stateEstimateZ__rateYaw=mrad[:, 2])
    np.testing.assert_allclose(np.column_stack([columns[f"gyro_{a}_radps"] for a in "xyz"]), rates, atol=1e-9)
    assert not meta["warnings"]


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_missing_pitch_rate_costs_its_own_sample(sign):
    """One NaN took the whole pitch rate with it."""
    angles, table = attitude(seed=2)
    turns = Rotation.from_euler("ZYX", angles[:, ::-1])
    rates = np.vstack([np.zeros(3), (turns[:-1].inv() * turns[1:]).as_rotvec()]) / 0.01
    mrad = 1e3 * rates * (1.0, sign, 1.0)
    mrad[7, 1], rates[7, 1] = np.nan, np.nan
    columns, _ = converted(**table, stateEstimateZ__rateRoll=mrad[:, 0], stateEstimateZ__ratePitch=mrad[:, 1],
                           stateEstimateZ__rateYaw=mrad[:, 2])
    np.testing.assert_allclose(columns["gyro_y_radps"], rates[:, 1], atol=1e-9)


def test_a_pitch_rate_without_attitude_is_left_out():
    columns, meta = converted(**{f"stateEstimateZ__rate{a}": [1.0, 2.0] for a in ("Roll", "Pitch", "Yaw")})
    assert "gyro_y_radps" not in columns and "gyro left out" in meta["warnings"][0]
