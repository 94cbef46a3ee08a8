"""The table of nominal scatter is written where there is none, or with --force."""

import sys

import pytest

from airtouch.errors import AirTouchError
from tools.calibration import nominal_scatter


@pytest.mark.parametrize(("more", "refusal"), [([], "--force"), (["--force"], "airtouch")])
def test_a_table_is_replaced_with_force_alone(tmp_path, monkeypatch, more, refusal):
    """With it, the run gets as far as the flights, of which there are none."""
    table = tmp_path / "table.toml"
    table.write_text("# of hours")
    monkeypatch.setattr(sys, "argv", ["nominal_scatter.py", str(tmp_path), "--out", str(table), *more])
    with pytest.raises(AirTouchError, match=refusal):
        nominal_scatter.main()
    assert table.read_text() == "# of hours"
