"""The decoder of the streaming network's logits, step by step on logits whose edges are counted by hand."""

import re
from pathlib import Path

import numpy as np
import pytest

from airtouch.errors import AirTouchError
from airtouch.reference.edge_decoder import DecoderConfig, edge_decoder

QUIET = DecoderConfig(arm_steps=5, dwell_steps=3, look_back=4, late_entry=99.0, late_exit=-99.0)
OFF = (-4.0, -9.0, -9.0)  #: over, entry, exit: neither over a platform nor at an edge


def logits(n, events=(), base=OFF):
    """(n, 3) of `base` with rows replaced: (step, row)."""
    values = np.tile(np.array(base, float), (n, 1))
    for step, row in events:
        values[step] = row
    return values


def edges(values, config=QUIET, airborne=None):
    """(step, edge) of what is decoded."""
    codes = edge_decoder(values, np.ones(len(values), bool) if airborne is None else airborne, config)
    assert codes.dtype == np.uint8 and codes.shape == (len(values),)
    return [(int(i), int(codes[i])) for i in np.flatnonzero(codes)]


def test_an_entry_then_an_exit():
    values = logits(40, [(10, (0.0, 1.0, -9.0)), (20, (0.0, -9.0, 1.0))])
    assert edges(values) == [(10, 1), (20, 2)]
    assert edges(logits(40)) == []
    assert edges(logits(40, [(10, (0.0, -9.0, 5.0))])) == [], "no exit where nothing was entered"
    assert edges(logits(40, [(10, (0.0, 1.0, -9.0)), (20, (0.0, 5.0, -9.0))])) == [(10, 1)], "no second entry"


@pytest.mark.parametrize(("row", "share", "score", "fires"), [
    ((-1.0, 0.6, -9.0), 0.5, 0.0, True), ((-1.0, 0.4, -9.0), 0.5, 0.0, False), ((1.0, -0.4, -9.0), 0.5, 0.0, True),
    ((1.0, -0.4, -9.0), 0.0, 0.0, False), ((0.0, 1.0, -9.0), 0.5, 1.0, False), ((0.0, 1.1, -9.0), 0.5, 1.0, True),
    ((0.0, 0.0, -9.0), 0.5, 0.0, False)])
def test_an_entry_fires_by_its_logit_beside_the_over_logit(row, share, score, fires):
    config = DecoderConfig(share, score, 9.0, 99.0, -99.0, arm_steps=5)
    assert bool(edges(logits(20, [(10, row)]), config)) == fires


@pytest.mark.parametrize(("row", "share", "score", "fires"), [
    ((1.0, -9.0, 0.6), 0.5, 0.0, True), ((1.0, -9.0, 0.4), 0.5, 0.0, False), ((-1.0, -9.0, -0.4), 0.5, 0.0, True),
    ((0.0, -9.0, 1.0), 0.5, 1.0, False), ((0.0, -9.0, 1.1), 0.5, 1.0, True)])
def test_an_exit_fires_by_its_logit_less_the_over_logit(row, share, score, fires):
    config = DecoderConfig(share, 0.0, score, 99.0, -99.0, arm_steps=5, dwell_steps=3)
    values = logits(30, [(10, (8.0, 8.0, -9.0)), (20, row)], (0.0, -9.0, -9.0))
    assert edges(values, config) == [(10, 1)] + [(20, 2)] * fires


def test_nothing_fires_before_it_is_armed_nor_soon_after_an_edge():
    entry, leave = (0.0, 1.0, -9.0), (0.0, -9.0, 1.0)
    assert edges(logits(20, [(3, entry)])) == [] and edges(logits(20, [(4, entry)])) == [(4, 1)]
    both = [(10, entry), (12, leave)]
    assert edges(logits(20, both)) == [(10, 1)] and edges(logits(20, [(10, entry), (13, leave)])) == [(10, 1), (13, 2)]


def test_the_smoothed_over_logit_fires_late():
    """From -3 (off) with p = 8: 8 - 11 * 0.9^k passes 2 at k = 6; after an edge it starts from 0."""
    config = DecoderConfig(0.0, 99.0, 99.0, late_entry=2.0, late_exit=-2.0, arm_steps=1, dwell_steps=1, look_back=0)
    steps = int(np.ceil(np.log(6.0 / 11.0) / np.log(0.9)))
    assert edges(logits(12, base=(8.0, -9.0, -9.0)), config) == [(steps - 1, 1)]
    down = logits(20, base=(-8.0, -9.0, -9.0))
    down[:steps] = (8.0, -9.0, -9.0)
    leave = int(np.ceil(np.log(6.0 / 8.0) / np.log(0.9)))
    assert edges(down, config) == [(steps - 1, 1), (steps - 1 + leave, 2)]
    faster = DecoderConfig(0.0, 99.0, 99.0, smooth_gain=0.5, arm_steps=1, look_back=0)
    assert edges(logits(12, base=(8.0, -9.0, -9.0)), faster) == [(0, 1)], "8 - 11 / 2 is more than 2"
    assert edges(logits(12, base=(20.0, -9.0, -9.0)), faster) == [(0, 1)]
    # logits are clamped: by a mean of -1000 it would take nine steps more
    assert edges(logits(5, [(0, (-1000.0, -9.0, -9.0))], (8.0, -9.0, -9.0)), faster) == [(2, 1)]


def test_an_edge_is_reported_so_many_steps_after_its_logit_peaked():
    """It fires at step 10; the peak lies two steps before, which its reporting counts from."""
    long_hold = DecoderConfig(0.5, 0.0, 0.0, 99.0, -99.0, arm_steps=5, dwell_steps=3, look_back=4, hold_steps=5)
    peak = [(8, (-8.0, 3.0, -9.0)), (9, (-8.0, 2.0, -9.0)), (10, (0.0, 1.0, -9.0))]
    assert edges(logits(30, peak), long_hold) == [(13, 1)]
    assert edges(logits(30, [(10, (0.0, 1.0, -9.0))]), long_hold) == [(15, 1)]
    rising = [*peak, (11, (0.0, 4.0, -9.0)), (12, (0.0, 3.5, -9.0))]
    assert edges(logits(30, rising), long_hold) == [(16, 1)], "a later, higher peak begins the wait anew"
    same = [*peak, (11, (0.0, 3.0, -9.0))]
    assert edges(logits(30, same), long_hold) == [(13, 1)], "one as high does not"
    equal = [(8, (-8.0, 3.0, -9.0)), (10, (0.0, 3.0, -9.0))]
    assert edges(logits(30, equal), long_hold) == [(15, 1)], "of two as high the later one"
    early = [(5, (-8.0, 3.0, -9.0)), (10, (0.0, 1.0, -9.0))]
    assert edges(logits(30, early), long_hold) == [(15, 1)], "five steps before is further than it looks back"
    within = [(6, (-8.0, 3.0, -9.0)), (10, (0.0, 1.0, -9.0))]
    assert edges(logits(30, within), long_hold) == [(11, 1)]
    short_hold = DecoderConfig(0.5, 0.0, 0.0, 99.0, -99.0, arm_steps=5, look_back=4, hold_steps=2)
    assert edges(logits(30, within), short_hold) == [(10, 1)], "at once where that has passed"


def test_an_exit_waits_for_its_own_logit_and_a_waiting_edge_is_reported_before_the_next():
    config = DecoderConfig(0.5, 0.0, 0.0, 99.0, -99.0, arm_steps=5, dwell_steps=3, look_back=0, hold_steps=6)
    entry, leave = (0.0, 1.0, -9.0), (0.0, -9.0, 1.0)
    assert edges(logits(40, [(10, entry), (20, leave)]), config) == [(16, 1), (26, 2)]
    assert edges(logits(40, [(10, entry), (13, leave)]), config) == [(13, 1), (19, 2)]
    higher = [(10, entry), (20, leave), (22, (0.0, -9.0, 2.0))]
    assert edges(logits(40, higher), config) == [(16, 1), (28, 2)]


def test_on_the_ground_all_is_forgotten():
    airborne = np.ones(40, bool)
    airborne[15] = False
    entry, leave = (0.0, 1.0, -9.0), (0.0, -9.0, 1.0)
    values = logits(40, [(10, entry), (18, entry), (25, leave), (30, entry)])
    assert edges(values, airborne=airborne) == [(10, 1), (30, 1)], "armed five steps after it took off again"
    values = logits(40, [(10, entry), (20, entry)])
    assert edges(values, airborne=airborne) == [(10, 1), (20, 1)]
    config = DecoderConfig(0.5, 0.0, 0.0, 99.0, -99.0, arm_steps=5, look_back=9, hold_steps=8)
    assert edges(logits(40, [(10, entry)]), config, airborne) == [], "what waits is not reported"
    before = [(14, (-8.0, 5.0, -9.0)), (20, entry)]
    assert edges(logits(40, before), config, airborne) == [(28, 1)], "it looks back no further than the take-off"
    assert edges(logits(40, [(10, entry)]), airborne=np.zeros(40, bool)) == []
    late = DecoderConfig(0.0, 99.0, 99.0, arm_steps=1, look_back=0)
    up = logits(40, base=(8.0, -9.0, -9.0))
    up[14] = up[15] = OFF
    airborne[:15] = False
    assert edges(up, late, airborne) == [(21, 1)], "the smoothed logit begins at -3 again"


def test_logits_that_are_no_number_say_no():
    values = logits(30, [(10, (np.nan, np.nan, np.nan)), (12, (0.0, 1.0, np.nan)), (20, (np.nan, -9.0, -7.0))])
    assert edges(values) == [(12, 1)], "-7 + 4 is no exit"
    with_exit = logits(30, [(12, (0.0, 1.0, -9.0)), (20, (np.nan, -9.0, -3.9))])
    assert edges(with_exit) == [(12, 1), (20, 2)], "over logit of -8, and -3.9 + 4 is more than 0"
    with_exit[20, 2] = -4.1
    assert edges(with_exit) == [(12, 1)]
    assert edges(np.zeros((0, 3))) == []


def test_the_crossing_is_looked_for_as_far_back_as_the_drone_keeps_logits():
    """The ring of edge_decoder.h holds this step and as many before it as may be asked for."""
    header = (Path(__file__).parents[2] / "firmware/kernels/edge_decoder.h").read_text()
    ring = int(re.search(r"#define EDGE_DECODER_RING (\d+)", header).group(1))
    assert DecoderConfig(look_back=ring - 1).look_back == 63
    with pytest.raises(AirTouchError, match="look_back is 64, not a whole number from 0 to 63"):
        DecoderConfig(look_back=ring)


def test_logits_are_clamped_at_eight():
    """An over logit of 100 counts as 8: half of it does not outweigh an entry logit of -5, nor one of -8 of -100."""
    assert edges(logits(20, [(10, (100.0, -5.0, -9.0))])) == []
    assert edges(logits(20, [(10, (100.0, -3.9, -9.0))])) == [(10, 1)]
    high = DecoderConfig(0.5, 11.5, 0.0, 99.0, -99.0, arm_steps=5)
    assert edges(logits(20, [(10, (8.0, 100.0, -9.0))]), high) == [(10, 1)]
    assert edges(logits(20, [(10, (-100.0, 3.9, -9.0))])) == [] and edges(logits(20, [(10, (-100.0, 4.1, -9.0))]))
