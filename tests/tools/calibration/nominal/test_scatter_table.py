"""The table of nominal scatter as text: what is read and written again is the shipped one."""

from importlib import resources

from airtouch.gap.signatures.scatter import table
from tools.calibration.nominal import scatter_table

SHIPPED = (resources.files("airtouch") / "gap" / "signatures" / "nominal_scatter.toml").read_text(encoding="utf-8")


def test_the_shipped_table_is_written_as_it_was_read():
    counts = scatter_table.counts_of(SHIPPED)
    assert set(counts) == set(table()) and all("flights" in count for count in counts.values())
    assert scatter_table.text_of(table(), counts).strip() == SHIPPED.strip()


def test_every_class_has_the_size_of_every_passing_effect():
    sizes = frozenset({"downwash", "gust", "wind", "unsteady_yaw", "downward"})
    assert {frozenset(s.passing) for s in table().values()} == {sizes}
