"""Lines of turning rotors: where they lie, how wide and how strong they are, and the speeds that say so."""

import numpy as np
import pytest

from airtouch import vehicle as vehicles
from airtouch.gap.evidence import vibration_lines
from airtouch.gap.nominal.build_study import declared_study
from airtouch.gap.signals.spectra import AIR, frequencies
from gap_flights import flight as made_flight

VEHICLE = vehicles.load()


def test_lines_of_steady_rotors_lie_at_their_fold_with_their_power():
    turns = np.array([318.0, 327.0, 336.0, 345.0])
    speed = np.tile(2.0 * np.pi * turns, (400, 1))
    hover = 2.0 * np.pi * 327.0
    power = vibration_lines.folded(vibration_lines.two_sided(speed, hover, np.array([0, 128])))
    f = frequencies(AIR)
    for k, place in enumerate((18.0, 27.0, 36.0, 45.0)):
        line = power[0, np.abs(f - place) < 2.0].sum() * f[1]
        assert line == pytest.approx(0.5 * 0.5 ** 2 * (turns[k] / 327.0) ** 4, rel=0.02)
        assert abs(f[np.argmax(np.where(np.abs(f - place) < 4.0, power[0], 0.0))] - place) <= f[1]
    assert np.all(vibration_lines.folded(np.ones((1, 256)))[0, 1:-1] == 0.5)


def test_a_rotor_whose_speed_was_lost_turns_on():
    rpm = np.linspace(19000.0, 21000.0, 400)
    lost = (np.arange(400) % 40) < 3
    one = made_flight(4.0)
    one.log.columns.update({name: np.where(lost, np.nan, rpm) for name in vibration_lines.RPM})
    speed = vibration_lines.speeds(one, declared_study(VEHICLE, ()))
    assert speed == pytest.approx(np.tile(rpm[:, None] * np.pi / 30.0, 4), rel=1e-2)


def test_a_spread_keeps_the_power_and_has_its_width():
    speed = np.full((256, 4), 2.0 * np.pi * 325.0)
    sharp = vibration_lines.two_sided(speed, speed[0, 0], np.array([0]))
    wide = vibration_lines.widened(sharp, 3.0)
    assert wide.sum() == pytest.approx(sharp.sum(), rel=1e-6)
    f = np.fft.fftfreq(256, 0.01)
    middle = (f * wide[0]).sum() / wide.sum()
    near = np.abs(f - 25.0) < 12.0
    spread = np.sqrt(((f - middle) ** 2 * wide[0])[near].sum() / wide[0, near].sum())
    assert middle == pytest.approx(25.0, abs=0.3) and spread == pytest.approx(3.0, rel=0.1)
