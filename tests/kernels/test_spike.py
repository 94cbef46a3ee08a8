"""How long one absurd sample is remembered: it counts as full scale, and that is over in seconds."""

import numpy as np
import pytest

from airtouch import kernels, reference
from airtouch.detector import best
from airtouch.kernels.stream_detector import stream_detector
from airtouch.vehicle import load

VEHICLE = load("crazyflie-2.1-flow")
AT, LONG = 1000, 6000  #: samples
#: signal -> full scale, which is where its values are clamped
FULL = {"acc": 240.0, "gyro": 40.0, "pwm": 65535.0, "axis": 1.0, "vbat": 8.0}


def hover():
    """A minute of hover: noise about as in the recorded flights."""
    rng = np.random.default_rng(0)
    return {"acc": rng.normal(0, 0.07, (LONG, 3)) + [0, 0, 9.81], "gyro": rng.normal(0, 0.05, (LONG, 3)),
            "pwm": 48_000 + rng.normal(0, 300, (LONG, 4)), "axis": np.tile([0.0, 0.0, 1.0], (LONG, 1)),
            "vbat": np.full(LONG, 3.8)}


def pipeline(module, signals):
    s = {name: np.float32(values) for name, values in signals.items()}
    return module.edge_pipeline(s["acc"], s["gyro"], s["pwm"], VEHICLE, thrust_axis=s["axis"], vbat_v=s["vbat"])


def spiked(name, value):
    signals = hover()
    signals[name][AT] = value
    return signals


def seconds(differs):
    """From the spike to the last sample that differs."""
    at = np.flatnonzero(differs[AT:])
    return 0.01 * (at[-1] + 1) if at.size else 0.0


@pytest.mark.parametrize("module", [kernels, reference], ids=["c", "numpy"])
@pytest.mark.parametrize("name, value", [*((name, value) for name in ("acc", "gyro", "pwm", "axis")
                                           for value in (1e5, 1e9, 1e15, 3e38)), ("vbat", 30.0), ("vbat", 1000.0)])
def test_what_no_sensor_can_say_is_its_full_scale(module, name, value):
    ours, full = pipeline(module, spiked(name, value)), pipeline(module, spiked(name, FULL[name]))
    for field in ("features", "force", "cfar_power", "threshold", "alert"):
        np.testing.assert_array_equal(getattr(ours, field), getattr(full, field), err_msg=field)


@pytest.mark.parametrize("name, threshold_s", [("acc", 8.0), ("gyro", 0.0), ("pwm", 4.5), ("axis", 6.0), ("vbat", 6.0)])
def test_a_spike_of_full_scale_is_forgotten_in_seconds(name, threshold_s):
    value = -1.0 if name == "axis" else FULL[name]
    clean, dirty = pipeline(kernels, hover()), pipeline(kernels, spiked(name, value))
    features = seconds(np.any(np.abs(dirty.features - clean.features) > 0.01 * clean.features, axis=1))
    threshold = seconds(np.abs(dirty.threshold - clean.threshold) > 0.01 * clean.threshold)
    blind = seconds(dirty.threshold > 2 * clean.threshold)
    print(f"\n{name} {value:g}: features as without it after {features:.1f} s, FR-CFAR's threshold after "
          f"{threshold:.1f} s, less than twice that after {blind:.1f} s")
    assert features <= 2.0 and threshold <= threshold_s


@pytest.mark.parametrize("name, logits_s", [("acc", 2.6), ("gyro", 2.6), ("pwm", 25.0)])
def test_what_best_remembers_of_a_spike(name, logits_s):
    model = best.load(None)
    runs = [stream_detector(*(np.float32(s[k]) for k in ("acc", "gyro", "pwm")), model.int8, model.recipe.motion,
                            model.decoder) for s in (hover(), spiked(name, FULL[name]), spiked(name, 1e15))]
    clean, full, absurd = (np.asarray(r.logits) for r in runs)
    np.testing.assert_array_equal(absurd, full)
    off = np.abs(full - clean).max(axis=1)
    print(f"\n{name} {FULL[name]:g}: logits of best as without it after {seconds(off > 0):.1f} s, within 2 after "
          f"{seconds(off > 2):.1f} s")
    assert seconds(off > 0) <= logits_s
