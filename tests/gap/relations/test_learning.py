"""Which classes of flights are learned, and from which strength on."""

import numpy as np
import pytest

from airtouch.gap.relations.learning import WEAKEST_SHIFT, all_drawings, drawings, scaled, weakest_strength
from airtouch.simulation.effects import EFFECTS, NAMES


@pytest.mark.parametrize(("effect", "shapes"), [
    ("mass", [None]), ("weak_motor", [1, 2, 3, 4]), ("gust", [0.2, 0.5, 1.5]), ("slung_load", [0.1, 0.2, 0.4])])
def test_each_value_of_what_shapes_an_effect_is_a_class(effect, shapes):
    assert [d.shape for d in drawings(effect)] == shapes


def test_each_gain_is_a_class_of_one_parameter():
    classes = drawings("controller_gain")
    assert [d.name for d in classes] == [f"controller_gain {p}" for p in ("rate", "attitude", "position", "height")]
    assert [d.free for d in classes] == [("rate",), ("attitude",), ("position",), ("height",)]


def test_every_effect_of_the_package_has_a_class():
    assert {d.kind.effect for d in all_drawings()} == set(NAMES) & set(EFFECTS)


def test_a_class_is_drawn_in_its_shape_and_scaled_to_natural_steps():
    drawing = drawings("weak_motor")[2]
    active = drawing.active(0.06, np.random.default_rng(1))
    assert active.values["rotor"] == 3 and active.values["thrust_loss"] == pytest.approx(0.06)
    step = next(p for p in active.effect.parameters if p.name == "thrust_loss").default
    assert scaled(drawing, active) == pytest.approx([0.06 / step])


@pytest.mark.parametrize("exponent", [1.0, 2.0])
def test_the_weakest_strength_shifts_flights_by_the_weakest_shift(exponent):
    """The median of three flights counts, of which one hit something; shifts grow as a power of the strength."""
    def shifts(strength):
        length = 1000.0 * strength ** exponent
        return [np.array([0.6 * length, 0.8 * length]), np.array([length, 0.0]), np.array([0.0, 1e6])]

    limit = (WEAKEST_SHIFT / 1000.0) ** (1.0 / exponent)
    weakest = weakest_strength(1.0, shifts)
    assert weakest <= limit < 2.0 * weakest and np.log2(weakest) == round(np.log2(weakest))


def test_a_strength_whose_flights_do_not_end_well_is_halved():
    weakest = weakest_strength(1.0, lambda strength: [] if strength > 0.1 else [np.zeros(2)])
    assert weakest == 0.0625
