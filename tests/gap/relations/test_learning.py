"""Which classes of flights are learned."""

import numpy as np
import pytest

from airtouch.gap.relations.learning import all_drawings, drawings, scaled
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
