"""An effect from a page of the docs, in a file of its own: flown, withheld, found again by name."""

import re
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from airtouch.gap.diagnosis import diagnose, diagnose_with_study
from airtouch.gap.flights.flight import ready_flights
from airtouch.gap.nominal import apparent
from airtouch.gap.relations import own_effect
from airtouch.gap.relations.settings import CalibrationSettings, OwnEffectSettings
from airtouch.simulation import batch, effects
from airtouch.vehicle import load
from gap_flights import LOOP
from hovers import STIFF

PAGE = Path(__file__).parents[2] / "host/docs/effects.md"
NAME = "made_up_magnet"  #: not the page's: who follows it to its end has a magnet in the package
FORCE_N = 0.02


@pytest.fixture(autouse=True)
def few_flights(monkeypatch):
    """The replay names these effects: a class of the relations from few flights is enough, for time.

    So are two of the nominal flights to say how the effects scatter.
    """
    monkeypatch.setattr(apparent, "FLIGHTS", 2)
    few = OwnEffectSettings(pairs=6, least_pairs=3, calibration=CalibrationSettings(class_flights=4))
    monkeypatch.setattr(own_effect, "completed", partial(own_effect.completed, settings=few))


@pytest.fixture
def magnet(tmp_path):
    """The docs' own example, registered for one test."""
    code = re.search(r"```python\n(\"\"\"A made-up effect.*?)```", PAGE.read_text(encoding="utf-8"), re.S).group(1)
    file = tmp_path / f"{NAME}.py"
    file.write_text(code.replace('"magnet"', f'"{NAME}"'), encoding="utf-8")
    (effect,) = effects.load_file(file)
    yield effect
    effects.unregister(effect.name)


def fly(count, seed, chosen=()):
    return list(batch.flights("diagnosis", count, effects=chosen, seed=seed, workers=1))


def test_a_users_effect_is_found_and_sized_and_is_unknown_when_left_out(magnet):
    vehicle = load("crazyflie-2.1-flow")
    nominal, real = fly(4, 1), fly(1, 2, [(NAME, {"force": FORCE_N})])
    assert len(Path(PAGE).read_text().split("```python")[1].split("```")[0].splitlines()) < 60
    diagnosis = diagnose(real, vehicle, nominal, without=LOOP)
    assert diagnosis.verdict == "effect" and diagnosis.effects[0].name == NAME
    # of what the replay, which named it, does not show
    reasons = [*diagnosis.cannot, *(r.why for r in diagnosis.ranking)]
    assert sum("here the replay gave the answer" in line for line in reasons) == 3
    assert not any("no library" in line for line in reasons)
    force = diagnosis.effects[0].parameters["force"]
    np.testing.assert_allclose(force.value, FORCE_N, rtol=0.3)
    assert diagnosis.shrink.value > 0.8
    assert abs(diagnosis.control.closure.shrink.value) < 0.2
    (switch_on,) = [step.command for step in diagnosis.next if NAME in step.text]
    assert f"{NAME}.py --effect {NAME}:force=" in switch_on  # without its file the command would be refused
    same_study, _ = diagnosis.calibrated
    left_out = diagnose_with_study(same_study, list(ready_flights(real, vehicle, [])), (*LOOP, NAME))
    assert NAME not in [r.name for r in left_out.ranking]
    assert left_out.gap["after"] > diagnosis.gap["after"]
    unknown, nearest, *_ = left_out.ranking
    assert left_out.verdict == unknown.name == "unknown" and unknown.shrink.value == 0.0  # as nothing is named
    assert re.match(r"the flight lies \d+ nats farther from it than nominal flights from none, but only up to \d+ ",
                    nearest.why)


def test_a_users_effect_that_only_the_commands_show_is_fitted(tmp_path):
    file = tmp_path / "stiff_climb.py"
    file.write_text(STIFF, encoding="utf-8")
    effects.load_file(file)
    try:
        vehicle = load("crazyflie-2.1-flow")
        stiff = fly(1, 4, [("stiff_climb", {"factor": 2.5})])
        diagnosis = diagnose(stiff, vehicle, fly(4, 3), without=LOOP)
    finally:
        effects.unregister("stiff_climb")
    assert diagnosis.ranking[0].name == "stiff_climb"
    np.testing.assert_allclose(diagnosis.effects[0].parameters["factor"].value, 2.5, rtol=0.35)
