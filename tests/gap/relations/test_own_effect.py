"""Effects that the shipped library has no class of: learned in closed loop, and left out where no flight ends well."""

import pytest

from airtouch.gap.relations import library, own_effect
from airtouch.gap.relations.hypotheses import FlightHypotheses
from airtouch.gap.relations.learning import Scene, fly
from airtouch.gap.relations.settings import CalibrationSettings, OwnEffectSettings
from airtouch.simulation import effects
from airtouch.simulation.effects import Active
from gap_flights import VEHICLE

#: half as many flights as else, for time
HALF = OwnEffectSettings(pairs=20, least_pairs=10, calibration=CalibrationSettings(class_flights=12, least_flights=6))
HEAD = '''"""An effect on a plant field."""
from airtouch.simulation.effects import Effect, Parameter


def settings(plant, v):
    '''
TOO_MUCH = HEAD + '''plant["gyro_scale"] *= 1.0 + v["share"]


EFFECT = Effect("gyro_scale", "a gyro that reads too much", (Parameter("share", "1", 0.05, 0.0, 0.5, 0.0, "too much"),),
                settings=settings)
'''
FALLS = HEAD + '''plant["gain"] = 0.0


EFFECT = Effect("no_thrust", "no rotor turns", (Parameter("share", "1", 0.05, 0.0, 0.5, 0.0, "of nothing"),),
                settings=settings)
'''


NOTHING = HEAD + '''plant["gyro_scale"] *= 1.0


EFFECT = Effect("nothing", "an effect that changes nothing",
                (Parameter("share", "1", 0.05, 0.0, 0.5, 0.0, "of nothing"),), settings=settings)
'''


@pytest.fixture
def register(tmp_path):
    """Registers the effect of a text for one test."""
    names = []

    def of(text):
        file = tmp_path / "own.py"
        file.write_text(text, encoding="utf-8")
        (effect,) = effects.load_file(file)
        names.append(effect.name)
        return effect

    yield of
    for name in names:
        effects.unregister(name)


def test_a_gyro_that_reads_too_much_is_the_likeliest_class_of_its_flights_and_sized(register):
    effect, shipped = register(TOO_MUCH), library.shipped()
    learned = own_effect.completed(shipped, VEHICLE, [effect.name, "mass"], HALF)
    assert learned.effects == shipped.effects | {effect.name}
    assert learned.model.classes[:-1] == shipped.model.classes
    own, scene = learned.model.classes[-1], Scene(shipped.scenario, VEHICLE)
    for number, share in ((7001, 0.06), (7002, 0.12)):  # not of the flights that it was learned from
        flight = FlightHypotheses(learned.coordinates(fly(scene, number, [Active(effect, {"share": share})])[None])[0],
                                  learned.model)
        first = flight.single_effects()[0]
        assert first.effect_names == (effect.name,)
        (amount,), (deviation,) = own.calibration.readout(first.fits[0].strength)
        assert 0.05 * amount == pytest.approx(share, rel=0.4) and abs(0.05 * amount - share) < 3.0 * 0.05 * deviation
    nothing = FlightHypotheses(learned.coordinates(fly(scene, 7003)[None])[0], learned.model)
    assert nothing.with_class(own).evidence < 3.0


@pytest.mark.parametrize("text", [FALLS, NOTHING], ids=["falls", "changes nothing"])
def test_an_effect_whose_flights_do_not_end_well_or_do_not_show_it_gets_no_class(register, text):
    shipped = library.shipped()
    assert own_effect.completed(shipped, VEHICLE, [register(text).name], HALF) is shipped
