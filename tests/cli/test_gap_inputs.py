"""What `airtouch gap diagnose` says of inputs and outputs that it cannot use, before any work."""

import pytest
from click.testing import CliRunner

from airtouch.cli.gap.diagnose import diagnose_command
from airtouch.errors import AirTouchError


def test_baseline_before_the_flights_is_told():
    result = CliRunner().invoke(diagnose_command, ["--baseline", "nominal.csv", "real.csv"])
    assert result.exit_code == 2 and "give REAL before --baseline" in result.output


def test_a_place_that_no_one_can_write_to_is_told_before_the_work(tmp_path):
    with pytest.raises(AirTouchError, match="cannot be written to"):
        CliRunner().invoke(diagnose_command, [str(tmp_path / "absent.csv"), "--report", "/proc/which.html"],
                           catch_exceptions=False, standalone_mode=False)
