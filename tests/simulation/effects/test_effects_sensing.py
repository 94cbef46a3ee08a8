"""Effects on sensors and log: each against its closed form."""

import numpy as np
import pytest
from scipy.signal import welch

from airtouch.errors import AirTouchError
from airtouch.logs import true_edges
from airtouch.logs.flight_log import ACC, GYRO, PWM
from airtouch.simulation import flight, scenario
from airtouch.simulation.plant import from_vehicle
from airtouch.simulation.sensors import filters, radio

SWEEP = """
name = "sweep"
[[platform]]
size_m = [1.5, 4.0]
centre_m = [2.0, 0.0]
top_m = 0.7
[[mission.step]]
do = "take-off"
height_m = 0.78
[[mission.step]]
do = "hover"
time_s = 8.0
[[mission.step]]
do = "go"
distance_m = 4.0
speed_mps = 0.3
"""


@pytest.fixture(scope="module")
def sweep(ideal):
    scene = scenario.parse(SWEEP, "sweep")

    def fly(effects=(), number=0):
        log = flight.fly(scene, ideal, 3, number, effects=effects)
        assert not isinstance(log, flight.Diverged), str(log)
        return log
    return fly


def test_imu_bias_shows_as_the_mean(steady):
    values = {"acc_x": 0.2, "acc_y": -0.1, "acc_z": 0.3, "gyro_x": 0.02, "gyro_y": 0.01, "gyro_z": -0.03}
    biased = flight_on_ground({"imu_bias": values})
    unbiased = flight_on_ground(())
    for name, value in values.items():
        column = f"{name}_mps2" if name.startswith("acc") else f"{name}_radps"
        assert (biased[column] - unbiased[column]).mean() == pytest.approx(value, abs=1e-6)


def flight_on_ground(effects):
    """The first 20 s of a flight that begin on the ground, motors off."""
    from airtouch import vehicle as vehicles
    steps = 'step = [{do = "wait", time_s = 20.0}, {do = "take-off", height_m = 0.3}, {do = "hover", time_s = 2.0}]'
    scene = scenario.parse(f"[mission]\n{steps}\n", "ground")
    return flight.fly(scene, vehicles.load(), 5, 0, effects=effects).slice(0, 2000)


@pytest.mark.parametrize("factor", [0.0, 1.0, 4.0])
def test_imu_noise_has_its_rms(vehicle, factor):
    log = flight_on_ground({"imu_noise": {"factor": factor}})
    still = log.slice(100, len(log))
    acc = factor * vehicle.acc_noise_rms_mps2 * np.array(vehicle.acc_noise_ratio)
    gyro = factor * vehicle.gyro_noise_rms_radps * np.array(vehicle.gyro_noise_ratio)
    np.testing.assert_allclose(still.stack(ACC).std(0), acc, rtol=0.12, atol=1e-3)
    np.testing.assert_allclose(still.stack(GYRO).std(0), gyro, rtol=0.12, atol=1e-3)


def test_vibration_folds_to_the_rotors_alias(steady):
    detuned = [("weak_motor", {"rotor": i, "thrust_loss": 0.004 * i}) for i in (1, 2, 3)]  # four lines, not one
    log = steady([("vibration", {"amplitude": 1.0, "gyro": 0.05}), *detuned])
    turns = log["rpm_1"].mean() / 60.0
    alias = abs(turns - 100.0 * round(turns / 100.0))
    f, power = welch(log["acc_x_mps2"], fs=100.0, nperseg=400)
    assert f[np.argmax(power)] == pytest.approx(alias, abs=4.0)
    # four lines of half the amplitude each: total rms = amplitude / sqrt(2)
    assert log["acc_x_mps2"].std() == pytest.approx(1.0 / np.sqrt(2), rel=0.25)


def test_latency_of_a_ring_is_exact_and_continuous():
    ring = np.arange(64.0)[:, None]
    assert filters.delayed(ring, 40, 0.0, 0) == 40.0
    assert filters.delayed(ring, 40, 7.25, 0) == pytest.approx(32.75)
    assert filters.delayed(ring, 2, 3.0, 0) == 63.0


def test_sensor_latency_moves_the_command_behind_the_gyro(vehicle, hover):
    """The derivative term answers every gyro sample; with a delay it answers an older one."""
    def lag(delay):
        log = flight.fly(hover, vehicle, 1, 0, effects={"sensor_latency": {"delay": delay},
                                                        "controller_gain": {"rate": 0.25, "attitude": 0.3}})
        log = log.slice(800, len(log))
        roll = log["m3_pwm"] + log["m4_pwm"] - log["m1_pwm"] - log["m2_pwm"]
        gyro = np.diff(log["gyro_x_radps"], prepend=0.0)
        roll = roll - np.convolve(roll, np.ones(9) / 9, "same")
        return np.argmin([np.dot(gyro[:-10], np.roll(roll, -k)[:-10]) for k in range(6)])
    assert lag(0.0) == 0
    assert lag(0.02) == 2


def test_time_jitter_has_its_rms_and_never_runs_backwards():
    table = np.zeros((5000, 2))
    table[:, 0] = 0.01 * np.arange(5000)
    truth = table[:, 0].copy()
    out = radio.received(table, 0.002, 0.0, 1.0, np.random.default_rng(0))
    assert np.std(out[:, 0] - truth) == pytest.approx(0.002, rel=0.05)
    assert np.all(np.diff(radio.received(table, 0.05, 0.0, 1.0, np.random.default_rng(1))[:, 0]) >= 0.0)


def test_where_a_row_lies_in_the_controllers_cycle(sweep):
    """The kick of a velocity step lasts 2 ms:
    a row at the position controller's run has it, one 4 ms behind has not."""
    def kick(behind):
        log = sweep({"time_jitter": {"rms": 0.0, "behind": behind}})
        pitch = (log["m1_pwm"] - log["m2_pwm"] - log["m3_pwm"] + log["m4_pwm"])[400:1400]
        return np.abs(pitch[1:-1] - 0.5 * (pitch[:-2] + pitch[2:])).max()
    at, behind = kick(0.0), kick(0.004)
    print(f"kick of the velocity step: {at:.0f} PWM at the run, {behind:.0f} behind it")
    assert at > 3.0 * behind


def test_a_row_has_the_yaw_loops_kick_only_where_the_yaw_is_renewed(sweep):
    """The estimator renews the yaw each 10 ms, the yaw's derivative is over 2 ms: there the commands answer a
    rate with 1 + 0.35 x 10 ms / 2 ms times what they answer it with in the four runs behind, or more."""
    def answer(settings):
        weak = {"rotor": 2, "thrust_loss": 0.1}  # it yaws as it takes off
        log = sweep({"weak_motor": weak, "time_jitter": {"rms": 0.0, **settings}})
        yaw, rate = log.stack(PWM)[150:300] @ [1.0, -1.0, 1.0, -1.0], log["gyro_z_radps"][150:300]
        return np.polyfit(np.diff(rate), np.diff(yaw), 1)[0]

    renewed, early, late, default = (answer(s) for s in ({"behind": 0.0}, {"behind": 0.004}, {"behind": 0.008}, {}))
    assert renewed / early > 2.75
    assert late / early == pytest.approx(1.0, abs=0.1)
    assert default == early


def test_packet_loss_has_its_share_and_bursts():
    table = 0.01 * np.arange(100_000)[:, None]
    out = radio.received(table, 0.0, 0.05, 4.0, np.random.default_rng(0))[:, 0]
    assert 1 - len(out) / 100_000 == pytest.approx(0.05, rel=0.1)
    gaps = np.round(np.diff(out) / 0.01).astype(int) - 1
    assert gaps[gaps > 0].mean() == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize("loss, burst", [(0.5, 1.0), (0.6, 1.0), (0.8, 1.0), (0.9, 3.0), (0.9, 9.0), (0.6, 4.0)])
def test_a_large_share_of_lost_rows_is_reached_by_longer_bursts(loss, burst):
    rows = 200_000
    out = radio.received(np.arange(rows)[:, None] * 0.01, 0.0, loss, burst, np.random.default_rng(0))[:, 0]
    gaps = np.round(np.diff(out) / 0.01) - 1.0
    assert 1.0 - len(out) / rows == pytest.approx(loss, abs=0.01)
    assert gaps[gaps > 0].mean() == pytest.approx(max(burst, loss / (1.0 - loss)), rel=0.03)


@pytest.mark.parametrize("loss", [1.0, -0.1, float("nan")])
def test_a_share_of_lost_rows_that_is_none_is_refused(loss):
    with pytest.raises(AirTouchError, match="share of lost rows"):
        radio.received(np.zeros((10, 1)), 0.0, loss, 2.0, np.random.default_rng(0))


def test_range_residual_shifts_the_height_over_the_platform(sweep):
    nominal, shifted = sweep(), sweep({"range_step": {"residual": 0.03, "kick": 0.0}})
    over = slice(true_edges(nominal)[0].sample + 350, true_edges(nominal)[1].sample)
    assert (shifted["z_m"] - nominal["z_m"])[over].mean() == pytest.approx(0.03, abs=0.012)


def test_range_kick_acts_once_at_each_edge(sweep):
    nominal, kicked = sweep(), sweep({"range_step": {"residual": 0.0, "kick": 0.05}})
    difference = np.abs(kicked.stack(PWM).mean(1) - nominal.stack(PWM).mean(1))
    first = true_edges(nominal)[0].sample
    assert difference[:first - 3].max() == 0.0
    assert difference[first - 3:first + 20].max() > 500.0


def test_one_reading_at_each_edge_mixes_both_surfaces(sweep):
    """Onto the platform between the two distances, off it between them or up to half the step beyond; the next
    reading is right again."""
    shares = {"entry": [], "exit": []}
    for number in range(12):
        log = sweep({"range_step": {"residual": 0.0, "kick": 0.0, "mixed": 1.0}}, number)
        for edge in true_edges(log):
            down = log["zrange_m"][edge.sample - 12:edge.sample + 12]
            share = (down - down[0]) / (-0.7 if edge.kind == "entry" else 0.7)
            first = np.flatnonzero(np.abs(share) > 0.06)[0]
            assert share[first + 3] == pytest.approx(1.0, abs=0.1)  # the next of 25 ms has only the new surface
            shares[edge.kind].append(share[first])
    print({kind: np.round(np.sort(some), 2) for kind, some in shares.items()})
    entry, leaving = np.array(shares["entry"]), np.array(shares["exit"])
    assert len(entry) > 6 and entry.max() < 1.05 and (entry < 0.5).sum() >= 2 and ((entry > 0.5) & (entry < 0.9)).any()
    beyond = leaving > 0.9
    assert 2 <= beyond.sum() <= len(beyond) - 2
    assert 1.1 < leaving.max() < 1.55 and leaving[~beyond].max() < 0.55
    nominal, never = sweep(), sweep({"range_step": {"residual": 0.0, "kick": 0.0, "mixed": 0.0}})
    assert (never["zrange_m"] == nominal["zrange_m"]).all()


def test_flow_scale_slows_the_drone_down_over_the_platform(sweep):
    log = sweep({"flow_scale": {"share": 0.1}})
    edges = true_edges(log)
    before = log["vx_mps"][edges[0].sample - 100:edges[0].sample].mean()
    settled = slice(edges[0].sample + 300, edges[0].sample + 400)
    assert before == pytest.approx(0.3, rel=0.08)  # the velocity loop's integral takes 25 s to settle
    true_height = (log["z_m"] - 0.7)[settled].mean()
    scale = 1 + 0.1 * (0.78 / true_height - 1)
    # slower by what the velocity loop's integral has gathered while it braked
    assert log["vx_mps"][settled].mean() == pytest.approx(0.3 / scale, rel=0.2)


def test_range_bias_is_the_error_of_the_down_range(sweep):
    """Over the floor nothing, over the platform near exp(-d / fade), with the true height from the position."""
    bias = {"near": -0.03, "fade": 0.04, "dip": 0.0, "delay": 0.0}
    log = sweep({"range_bias": bias})
    entry, leave = true_edges(log)[:2]
    true = log["z_m"] - np.where((np.arange(len(log)) > entry.sample) & (np.arange(len(log)) < leave.sample), 0.7, 0.0)
    error = log["zrange_m"] - true
    over, free = slice(entry.sample + 30, leave.sample - 10), slice(entry.sample - 300, entry.sample - 50)
    expected = np.maximum(-0.03 * np.exp(-true[over] / 0.04), -true[over])
    assert np.abs(error[over] - expected).mean() < 0.003
    assert np.abs(error[free]).mean() < 0.003


def test_range_dip_dies_out_after_the_entry(sweep):
    dips = {"near": 0.0, "dip": -0.04, "time": 0.2, "delay": 0.0}
    log = sweep({"range_bias": dips})
    entry, leave = true_edges(log)[:2]
    since = np.arange(5, 60)
    error = log["zrange_m"][entry.sample + since] - (log["z_m"][entry.sample + since] - 0.7)
    expected = np.maximum(-0.04 * np.exp(-0.01 * since / 0.2), -(log["z_m"][entry.sample + since] - 0.7))
    assert np.corrcoef(error, expected)[0, 1] > 0.95
    assert np.abs(error - expected).mean() < 0.006
    after = slice(leave.sample + 10, leave.sample + 60)
    assert np.abs(log["zrange_m"][after] - log["z_m"][after]).mean() < 0.01  # none at an exit


def test_range_delay_makes_the_log_late(sweep):
    def late(delay):
        log = sweep({"range_bias": {"near": 0.0, "dip": 0.0, "delay": delay}})
        entry = true_edges(log)[0].sample
        return log["x_m"][entry]
    assert late(0.1) - late(0.0) == pytest.approx(0.1 * 0.3, abs=0.015)


def test_a_late_range_makes_no_kick_of_the_flow(sweep):
    """Flow and range see the platform at once; only the reading is late:
    the motors' pitch stays as calm at the entry."""
    def kick(delay):
        log = sweep({"range_bias": {"near": 0.0, "dip": 0.0, "delay": delay}})
        entry = true_edges(log)[0].sample
        m1, m2, m3, m4 = (log[c][entry - 15:entry + 15] for c in PWM)
        return np.abs(m1 + m4 - m2 - m3).max()
    assert max(kick(0.012), kick(0.04)) < 1.5 * kick(0.0) + 500.0


def test_flow_latency_is_the_plants_delay(ideal):
    plant = from_vehicle(ideal)
    from airtouch.simulation import effects
    (active,) = effects.activate({"flow_latency": {"delay": 0.06}})
    active.effect.settings(plant[0], active.values)
    assert plant["flow_delay"] == 0.06


def test_reach_sees_the_platform_before_and_after_the_beam_does(sweep):
    """By reach over speed at both edges, and the beam alone at none."""
    narrow, wide = (true_edges(sweep({"range_bias": {"near": 0.0, "dip": 0.0, "reach": reach}}))
                    for reach in (0.0, 0.06))
    assert narrow[0].sample - wide[0].sample == pytest.approx(100 * 0.06 / 0.3, abs=4)
    assert wide[1].sample - narrow[1].sample == pytest.approx(100 * 0.06 / 0.3, abs=6)


@pytest.mark.parametrize("condition", [{"above": 0.4}, {"wait": 1.0}])
def test_flow_transient_waits_and_only_acts_above(sweep, condition):
    """Bit by bit as without it until its time, for ever where the drone is too low; with neither it acts at once."""
    still, free, withheld = (sweep({"flow_scale": {"share": 0.0, "transient": 0.5, **values}})
                             for values in ({"transient": 0.0}, {}, condition))
    entry = true_edges(still)[0].sample
    until = len(still) if "above" in condition else entry + 90
    np.testing.assert_array_equal(withheld["vx_mps"][:until], still["vx_mps"][:until])
    assert np.abs(free["vx_mps"] - still["vx_mps"])[entry:entry + 90].max() > 0.01
    if "wait" in condition:
        assert np.abs(withheld["vx_mps"] - still["vx_mps"])[until:].max() > 0.01


def test_leaving_a_surface_presses_down_and_entering_it_does_not(sweep):
    nominal, pressed = (sweep({"ground_effect": {"turbulence": 0.0, "leaving": share}}) for share in (0.0, 0.05))
    entry, leave = true_edges(nominal)[:2]
    np.testing.assert_array_equal(pressed["acc_z_mps2"][:leave.sample - 60], nominal["acc_z_mps2"][:leave.sample - 60])
    change = (pressed["acc_z_mps2"] - nominal["acc_z_mps2"])[leave.sample - 60:leave.sample + 30]
    assert change.min() == pytest.approx(-0.05 * 9.81, rel=0.4)
