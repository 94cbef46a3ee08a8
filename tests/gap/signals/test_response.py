"""How the gyro follows logged commands: against the closed forms of errors in variables, and made laws."""

from dataclasses import replace

import numpy as np
import pytest

from airtouch.gap.loop.disturbed import Disturbed
from airtouch.gap.loop.torque_share import QUIET, STEPPED, Change, response_ratio
from airtouch.gap.signals import quiet_blocks
from airtouch.gap.signals.channels import COUNT, TORQUE
from airtouch.gap.signals.quiet_blocks import QuietPower
from airtouch.gap.signals.response import (
    CUT_DOUBT,
    FIRST_BIN,
    NOISE,
    Law,
    OutsideTorque,
    Response,
    TorqueSpectra,
    response_of,
)
from airtouch.gap.signals.spectra import AIR, frequencies

BINS = len(frequencies(AIR))
NO_LOOP = Disturbed(np.zeros((BINS, 3)), np.zeros((BINS, 3)))
NO_NOISE = np.zeros((BINS, 3))


def noise(rng, size, rms=1.0):
    return rms * (rng.normal(size=size) + 1j * rng.normal(size=size)) / np.sqrt(2.0)


def flights(rng, true, alias, count=12, blocks=12):
    """Spectra measured and modelled: the vehicle feels `true` of what the log says, the rest is folded noise."""
    felt = [noise(rng, (blocks, BINS, 3), true) for _ in range(count)]
    commands = [t + noise(rng, t.shape, alias) for t in felt]
    return felt, commands


def torques(felt, commands):
    """The spectra of each flight: what the gyro measured, and what the model makes of the commands."""
    return [TorqueSpectra(f, w) for f, w in zip(felt, commands, strict=True)]


def test_share_is_that_of_errors_in_variables():
    rng = np.random.default_rng(1)
    felt, commands = flights(rng, 1.0, 1.0)
    response = response_of(torques(felt, commands), NO_LOOP, NO_NOISE)
    np.testing.assert_allclose(response.quiet_law.coherent.real, 1.0 / (1.0 + 1.0), atol=0.1)
    np.testing.assert_allclose(response.quiet_law.coherent.imag, 0.0, atol=0.1)


def test_a_share_no_surer_than_noise_is_not_believed():
    rng = np.random.default_rng(5)
    felt, commands = flights(rng, 1.0, 3.0)  # coherence 1 / (1 + 9)
    response = response_of(torques(felt, commands), NO_LOOP, NO_NOISE)
    assert np.median(np.abs(response.quiet_law.coherent)) == 0.0


@pytest.mark.parametrize("fraction", [0.0, 0.1, 0.5, 0.95])
def test_gyro_noise_that_the_controllers_answer_is_no_response(fraction):
    """Commands follow what was measured; of that `fraction` is known to be noise, and makes so much coherence alone."""
    rng = np.random.default_rng(6)
    felt = [noise(rng, (12, BINS, 3)) for _ in range(12)]
    commands = [-0.1 * y for y in felt]  # coherence 1, q = -10
    law = response_of(torques(felt, commands), NO_LOOP, np.full((BINS, 3), fraction)).quiet_law
    np.testing.assert_allclose(law.transfer, -10.0, atol=1e-6)
    believed = np.clip((1.0 - max(fraction, 0.2)) / max(fraction, 0.2), 0.0, 1.0)
    np.testing.assert_allclose(np.median(law.coherent.real), -10.0 * believed, atol=0.5)


def test_a_weaker_response_earns_nothing_on_nominal_flights():
    """With q = 1 half the response halves what folded noise leaves; with q as measured it adds to it."""
    rng = np.random.default_rng(2)
    felt, commands = flights(rng, 1.0, 2.0)
    response = response_of(torques(felt, commands), NO_LOOP, NO_NOISE)
    y, w = (x[0] for x in flights(rng, 1.0, 2.0, 1))
    def table(torque):
        return np.concatenate([np.zeros((*torque.shape[:2], 3)), torque,
                                               np.zeros((*torque.shape[:2], COUNT - 6))], axis=2)
    nominal, weaker = table(y - w), table(y - 0.5 * w)
    def size(x):
        return np.mean(np.abs(x[:, FIRST_BIN:, TORQUE]) ** 2)
    steady = response.quiet(w)
    assert steady.all()
    assert size(weaker) < 0.6 * size(nominal)
    before, after = (size(response.with_torque_gap(table(y - share * w), steady, TorqueSpectra(y, w, change)))
                     for share, change in ((1.0, None), (0.5, 0.5 * w)))
    assert after > before


def test_means_stay_as_they_are():
    rng = np.random.default_rng(3)
    felt, commands = flights(rng, 1.0, 2.0)
    response = response_of(torques(felt, commands), NO_LOOP, NO_NOISE)
    spectra = np.zeros((12, BINS, COUNT), complex)
    spectra[:, :, TORQUE] = felt[0] - commands[0]
    out = response.with_torque_gap(spectra, response.quiet(commands[0]), TorqueSpectra(felt[0], commands[0]))
    np.testing.assert_array_equal(out[:, :FIRST_BIN], spectra[:, :FIRST_BIN])


def test_blocks_in_which_a_set_point_stepped_have_a_law_and_a_weight_of_their_own():
    rng = np.random.default_rng(4)
    felt, commands = flights(rng, 1.0, 1.0, 12, 20)
    for f, w in zip(felt, commands, strict=True):  # every fourth block: a kick of which a third turns the vehicle
        kick = noise(rng, (5, BINS, 3), 30.0)
        w[::4] += kick
        f[::4] += kick / 3.0 + noise(rng, kick.shape, 3.0)
    response = response_of(torques(felt, commands), NO_LOOP, NO_NOISE)
    np.testing.assert_array_equal(response.quiet(commands[0])[:, 0], np.arange(20) % 4 != 0)
    np.testing.assert_allclose(np.abs(response.stepped_law.coherent), 1.0 / 3.0, atol=0.05)
    variances = 1.0 - 0.5, 9.0 + 4.0 / 9.0 + 1.0 / 9.0  # of power: of errors in variables; the kick's own scatter
    np.testing.assert_allclose(np.median(response.stepped_law.weight), np.sqrt(variances[0] / variances[1]), rtol=0.1)


@pytest.mark.parametrize("count", [1, 2, 4, 6, 12])
def test_of_few_quiet_blocks_a_higher_coherence_is_believed(monkeypatch, count):
    """The coherence of n blocks of noise is 1/n by chance: noise is next to never believed, a clean response is."""
    estimate = quiet_blocks.estimate_quiet_power

    def with_few_on_one_axis(modelled, power):
        found = estimate(modelled, power)
        quiet = np.ones_like(found[1])
        quiet[count:, 0] = False
        return found[0], quiet

    monkeypatch.setattr(quiet_blocks, "estimate_quiet_power", with_few_on_one_axis)
    rng = np.random.default_rng(9)
    commands = flights(rng, 1.0, 1.0, 1, 40)[1]
    noise = [rng.normal(size=c.shape) + 1j * rng.normal(size=c.shape) for c in commands]
    clean, of_noise = (response_of(torques(felt, commands), NO_LOOP, NO_NOISE)
                       for felt in ([0.5 * c for c in commands], noise))
    assert (clean is None) == (of_noise is None) == (count < 2)
    if clean is not None:
        assert np.mean(np.abs(of_noise.quiet_law.coherent[FIRST_BIN:, 0])) < 0.08
        np.testing.assert_allclose(np.abs(clean.quiet_law.coherent[FIRST_BIN:, 0]), 0.5, atol=0.02)


@pytest.mark.parametrize("strength", [1.0, 1.8, 2.0, 3.0])
def test_flights_that_differ_so_much_that_an_axis_is_never_quiet_have_no_response(strength):
    """The share is 1/2 in all flights; two short ones are flown harder, so that no block is like those of the others.

    Without quiet blocks there is neither a share nor a floor to weight other blocks to: it would weight them by 0.
    """
    rng = np.random.default_rng(8)
    long, short = flights(rng, 1.0, 1.0, 1, 40), flights(rng, 1.0, 1.0, 2, 8)
    felt, commands = ([*a, *(strength * x for x in b)] for a, b in zip(long, short, strict=True))
    response = response_of(torques(felt, commands), NO_LOOP, NO_NOISE)
    assert (response is None) == (strength > 1.0)
    if response is not None:
        np.testing.assert_allclose(np.median(np.abs(response.quiet_law.coherent), axis=0), 0.5, atol=0.02)


def law(kind=QUIET, coherent=0.5, weight=1.0, remains=0.5 + 0.5j, power=2.0):
    """A law of the same numbers in all bins and axes."""
    def table(x):
        return np.full((BINS, 3), x)

    return Law(kind, table(coherent), table(coherent), OutsideTorque(table(remains), table(power)), table(weight),
               table(1.0), table(0.0))


def response(stepped=True):
    """A response to quiet blocks, whose torque is taken as it is, and to stepped ones, which weigh 0.2."""
    return Response(QuietPower(np.ones((BINS, 3)), np.ones(3)), law(power=3.0),
                    law(STEPPED, coherent=0.5j, weight=0.2, power=7.0) if stepped else None)


#: three blocks: in the second a set-point stepped about the first axis, in the third about all
SOME_QUIET = np.array([[True, True, True], [False, True, True], [False, False, False]])


def drawn_change(cut=0.0):
    """What effects change in a loop, of drawn numbers; cut: the part that the limits of a command make."""
    rng = np.random.default_rng(3)

    def drawn(*shape):
        return 1.0 + 0.3 * rng.normal(size=shape) + 0.3j * rng.normal(size=shape)

    return Change(motors=drawn(BINS, 1), share=drawn(2, BINS, 3), before=0.4 * drawn(2, BINS, 3),
                  cut=np.full((BINS, 3), cut), logged=drawn(BINS, 1), incoherent=np.ones((2, BINS, 3)))


@pytest.mark.parametrize("kind", [QUIET, STEPPED])
def test_ratio_of_roll_and_pitch_is_that_of_the_torque_share(kind):
    change, response_law = drawn_change(), law(kind, coherent=4.0)
    expected = response_ratio(change, kind, response_law.transfer)
    np.testing.assert_array_equal(response_law.ratio(change)[:, :2], expected[:, :2])


@pytest.mark.parametrize(("coherent", "part"), [(0.5, 1.0), (1.0, 1.0), (2.0, 0.25), (-3.0j, 1.0 / 9.0)])
def test_in_yaw_the_ratio_changes_less_where_the_response_is_above_one(coherent, part):
    """There most of it is noise of the gyro, which no effect changes: of its square 1 / |q~|^2 is the vehicle's."""
    change, response_law = drawn_change(), law(coherent=coherent)
    whole = response_ratio(change, QUIET, response_law.transfer)[:, 2]
    assert np.abs(whole - 1.0).max() > 0.1
    np.testing.assert_allclose(response_law.ratio(change)[:, 2] - 1.0, part * (whole - 1.0))


def test_torque_is_weighted_as_blocks_of_its_kind_are():
    torque = noise(np.random.default_rng(6), (3, BINS, 3))
    weights = response().weighted(SOME_QUIET, torque) / torque
    np.testing.assert_allclose(weights, np.where(SOME_QUIET, 1.0, 0.2)[:, None] * np.ones((1, BINS, 1)))
    unknown = np.isnan(response(stepped=False).weighted(SOME_QUIET, torque))
    np.testing.assert_array_equal(unknown, np.broadcast_to(~SOME_QUIET[:, None], unknown.shape))


def test_doubt_is_the_error_of_what_limits_cut_off_steps():
    """In stepped blocks alone: (CUT_DOUBT * weight * |q~| * cut)^2 of the power of the modelled torque."""
    modelled = noise(np.random.default_rng(7), (3, BINS, 3), 2.0)
    doubt = response().doubt(SOME_QUIET, modelled, drawn_change(cut=0.3))
    of_steps = (CUT_DOUBT * 0.2 * 0.5 * 0.3) ** 2 * np.abs(modelled) ** 2
    np.testing.assert_allclose(doubt, np.where(SOME_QUIET[:, None], 0.0, of_steps))


def test_where_no_law_of_steps_is_known_there_is_no_doubt():
    """Neither without such a law nor on an axis with too few of its blocks: nothing of them is counted."""
    modelled, change = noise(np.random.default_rng(7), (3, BINS, 3)), drawn_change(cut=0.3)
    assert not response(stepped=False).doubt(SOME_QUIET, modelled, change).any()
    few = response()
    few.stepped_law.weight[:, 0] = np.nan
    doubt = few.doubt(SOME_QUIET, modelled, change)
    assert not doubt[:, :, 0].any() and (doubt[2, :, 1:] > 0.0).all()


@pytest.mark.parametrize(("sensed", "quiet", "stepped"), [(True, 1.0, 0.2 ** 2), (False, 3.0, 0.2 ** 2 * 7.0)])
def test_power_of_a_random_torque_is_that_of_the_law_above_the_means(sensed, quiet, stepped):
    """What the gyro alone senses passes no loop; any other torque leaves what the law says."""
    power = response().random_power(SOME_QUIET, sensed)
    expected = np.where(SOME_QUIET, quiet, stepped)[:, None] * np.ones((1, BINS, 1))
    np.testing.assert_allclose(power[:, FIRST_BIN:], expected[:, FIRST_BIN:])
    np.testing.assert_array_equal(power[:, :FIRST_BIN], 1.0)


def test_power_of_a_random_torque_stays_where_no_law_is_known():
    power = response(stepped=False).random_power(SOME_QUIET, sensed=False)
    above = power[:, FIRST_BIN:, 0]
    np.testing.assert_allclose(above, np.where(SOME_QUIET[:, :1], 3.0, 1.0) * np.ones(above.shape))


def test_noise_may_make_the_torque_where_it_is_a_part_of_its_power_above_the_means():
    share = np.full((BINS, 3), NOISE - 0.01)
    share[:, 2] = NOISE + 0.01
    expected = np.zeros((BINS, 3), bool)
    expected[FIRST_BIN:, 2] = True
    of = response()
    assert (replace(of, quiet_law=replace(of.quiet_law, of_gyro=share)).may_be_gyro == expected).all()
