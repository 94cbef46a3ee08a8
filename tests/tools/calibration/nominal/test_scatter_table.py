"""The table of nominal scatter as text: what is read and written again is the shipped one."""

from dataclasses import replace
from importlib import resources

import pytest

from airtouch.gap.signatures.scatter import table
from tools.calibration.nominal import scatter_table
from tools.calibration.nominal.comparisons import Task
from tools.calibration.nominal.groups import Group

SHIPPED = (resources.files("airtouch") / "gap" / "signatures" / "nominal_scatter.toml").read_text(encoding="utf-8")


def test_the_shipped_table_is_written_as_it_was_read():
    counts = scatter_table.counts_of(SHIPPED)
    assert set(counts) == set(table()) and all("flights" in count for count in counts.values())
    assert scatter_table.text_of(table(), counts).strip() == SHIPPED.strip()


def test_every_class_has_the_size_of_every_passing_effect():
    sizes = frozenset({"downwash", "gust", "wind", "unsteady_torque", "unsteady_lift", "downward"})
    assert {frozenset(s.passing) for s in table().values()} == {sizes}


def test_with_passing_the_passing_effects_are_new_and_all_else_is_as_shipped():
    """Sizes of 1 and 3: mean 2, standard deviation the root of 2."""
    tasks = [Task(Group(of, "one", "day", None, [("a", None), ("b", None)]), passing=True) for of in table()]
    rows = {f"{name}, passing effects": {"strengths": {}, "errors": {}, "rate": 9.0, "passing": {"gust": size}}
            for name, size in (("a", 1.0), ("b", 3.0))}
    new, counts = scatter_table.with_passing(tasks, rows), scatter_table.counts_of(SHIPPED)
    assert all(s.passing == {"gust": pytest.approx((2.0, 2.0 ** 0.5))} for s in new.values())
    shipped_passing = {of: replace(s, passing=table()[of].passing) for of, s in new.items()}
    assert scatter_table.text_of(shipped_passing, counts).strip() == SHIPPED.strip()
