"""Effects that a user thinks of first, each written as one file and flown by `simulate`: they do what they say."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import airtouch as at
from airtouch.simulation import effects

HEAD = '''from airtouch.simulation import signals as at
from airtouch.simulation.effects import Effect, Parameter, wrench

'''
SETTINGS = HEAD + '''
def settings(plant, v):
    {body}


SIZE = Parameter("size", "{unit}", {default}, 0.0, {most}, 0.0, "how much")
EFFECT = Effect("{name}", "made up", (SIZE,), settings=settings)
'''
FALLS = HEAD + '''
@wrench
def push(p, s, memory, generator, out):
    if s[at.TIME] > p[1]:
        out[2] -= p[0]


EFFECT = Effect("own_load", "falls onto the drone", (Parameter("size", "N", 0.03, 0.0, 1.0, 0.0, "weight"),
                Parameter("since", "s", 8.0, 0.0, 100.0, None, "when")), wrench=push)
'''
FILES = {
    "own_battery": SETTINGS.format(name="own_battery", unit="ohm", default=0.3, most=1.0, body=(
        'plant["battery_strength"], plant["battery_charge"], plant["battery_resistance"] = 1.0, 0.9, v["size"]')),
    "own_resistance": SETTINGS.format(name="own_resistance", unit="ohm", default=0.15, most=1.0,
                                      body='plant["battery_resistance"] += v["size"]'),
    "own_gyro": SETTINGS.format(name="own_gyro", unit="1", default=0.3, most=1.0,
                                body='plant["gyro_scale"] *= 1.0 + v["size"]'),
    "own_slow": SETTINGS.format(name="own_slow", unit="s", default=0.05, most=1.0,
                                body='plant["motor_slowness"][2] = v["size"]'),
    "own_zone": SETTINGS.format(name="own_zone", unit="1", default=1500.0, most=60000.0,
                                body='plant["motor_dead_zone"][2] = v["size"]'),
    "own_load": FALLS}


@pytest.fixture
def fly_columns(tmp_path):
    """Columns of a hover with the effect of that file, or with none."""
    def fly(name=None, **values):
        if name is None:
            return at.simulate("hover", seed=4)[0].columns
        if name not in effects.EFFECTS:
            (tmp_path / f"{name}.py").write_text(FILES[name])
            effects.load_file(tmp_path / f"{name}.py")
        return at.simulate("hover", seed=4, effects={name: values})[0].columns

    yield fly
    for name in FILES:
        effects.EFFECTS.pop(name, None)


def hovering(columns, name, low=6.0, high=11.0):
    t = columns["t_s"] - columns["t_s"][0]
    return columns[name][(t > low) & (t < high)]


def test_an_old_battery_gives_less_voltage(fly_columns):
    low_ohm_v, high_ohm_v = (hovering(fly_columns("own_battery", size=ohm), "vbat_V").mean() for ohm in (0.05, 0.15))
    current = 85.0 * 4 * (0.0362 * 9.81 / 4) ** 1.5 / low_ohm_v  # power of a hover, W, over volts
    assert low_ohm_v - high_ohm_v == pytest.approx(0.1 * current, rel=0.25)


def test_a_resistance_alone_changes_nothing_while_the_motors_see_the_nominal_voltage(fly_columns):
    nominal, alone = fly_columns(), fly_columns("own_resistance", size=0.15)
    for name in nominal:
        np.testing.assert_array_equal(alone[name], nominal[name])


def test_a_gyro_that_reads_too_much_shows_a_turn_as_larger(fly_columns):
    """A body turns by what its attitude says; the gyro's integral over a tilt is larger by the share."""
    for share in (0.0, 0.4):
        c = fly_columns("own_gyro", size=share)
        rate, gyro = np.gradient(c["pitch_rad"], c["t_s"]), c["gyro_y_radps"]
        air = slice(400, 1100)
        slow = np.ones(8) / 8.0
        rate, gyro = (np.convolve(x[air] - x[air].mean(), slow, "valid") for x in (rate, gyro))
        assert rate @ gyro / (rate @ rate) == pytest.approx(1.0 + share, abs=0.12)


def lag_s(command, rpm):
    """Time by which a rotor's speed follows its command: the shift at which they agree best, 10 ms a row."""
    command, rpm = np.diff(command), np.diff(rpm)
    return 0.01 * int(np.argmax([np.corrcoef(command[:len(command) - k or None], rpm[k:])[0, 1] for k in range(30)]))


def test_one_motor_answers_late(fly_columns):
    nominal, slow = fly_columns(), fly_columns("own_slow", size=0.08)
    third = [lag_s(hovering(c, "m3_pwm"), hovering(c, "rpm_3")) for c in (nominal, slow)]
    first = [lag_s(hovering(c, "m1_pwm"), hovering(c, "rpm_1")) for c in (nominal, slow)]
    assert abs(third[0] - first[0]) <= 0.011 and third[1] - first[1] >= 0.03


def test_one_motor_does_not_answer_to_small_changes(fly_columns):
    nominal, zone = fly_columns(), fly_columns("own_zone", size=4000.0)
    still = [np.mean(np.abs(np.diff(hovering(c, "rpm_3"))) < 0.5) for c in (nominal, zone)]
    other = [np.mean(np.abs(np.diff(hovering(c, "rpm_1"))) < 0.5) for c in (nominal, zone)]
    assert still[1] > 0.1 > 2 * max(still[0], *other)  # share of rows in which the speed stands


def test_a_load_that_falls_onto_the_drone_half_way(fly_columns):
    with_load, nominal = fly_columns("own_load", size=0.05, since=7.0), fly_columns()
    pwm = [np.mean([hovering(c, f"m{i}_pwm", 5.0, 6.9).mean() for i in range(1, 5)]) for c in (nominal, with_load)]
    later = [np.mean([hovering(c, f"m{i}_pwm", 9.0, 11.0).mean() for i in range(1, 5)]) for c in (nominal, with_load)]
    assert pwm[0] == pytest.approx(pwm[1], abs=1.0)
    assert later[1] / later[0] - 1.0 > 0.05  # 14 % more weight


def test_threads_that_load_one_effect_at_once_get_the_same_one():
    """As the tasks of a dask worker do; the file takes 0.1 s to run, so that all of them are at it."""
    text = "import time\n" + SETTINGS.format(name="own_of_threads", unit="1", default=0.3, most=1.0, body="pass")
    text += "time.sleep(0.1)\n"
    try:
        with ThreadPoolExecutor(4) as pool:
            loaded = list(pool.map(effects.load_text, [text] * 4))
        assert all(one == [effects.get("own_of_threads")] for one in loaded)
    finally:
        effects.unregister("own_of_threads")
