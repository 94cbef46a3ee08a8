"""Firmware files: a base beside the file, no circle of bases, and no value that is taken for another."""

import pytest

from airtouch.errors import AirTouchError
from airtouch.simulation.firmware import settings


def test_a_base_is_a_file_beside_the_one_that_names_it(tmp_path, monkeypatch):
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "mine.toml").write_text('base = "other.toml"\n')
    (tmp_path / "sub" / "other.toml").write_text('base = "2026.08"\n[controller]\ntilt_limit_deg = 7\n')
    (tmp_path / "other.toml").write_text('base = "2026.08"\n[controller]\ntilt_limit_deg = 9\n')
    monkeypatch.chdir(tmp_path)
    for path in ("sub/mine.toml", tmp_path / "sub" / "mine.toml"):
        assert settings.load(path)[0]["controller"]["tilt_limit_deg"] == 7.0
    (tmp_path / "far.toml").write_text(f"base = '{tmp_path / 'sub' / 'mine.toml'}'\n")
    assert settings.load("far.toml")[0]["controller"]["tilt_limit_deg"] == 7.0


@pytest.mark.parametrize("base", ["a.toml", "./a.toml", "b.toml"])
def test_files_that_name_one_another_are_refused(tmp_path, base):
    (tmp_path / "a.toml").write_text(f'base = "{base}"\n')
    (tmp_path / "b.toml").write_text('base = "a.toml"\n')
    with pytest.raises(AirTouchError, match="name one another|must name another"):
        settings.load(tmp_path / "a.toml")


@pytest.mark.parametrize(("section", "line", "message"), [
    ("periods", "range_ms = 25.7", "periods.range_ms = 25.7 must be a whole number"),
    ("periods", "flow_ms = 1e30", "periods.flow_ms = 1e+30 must be a whole number"),
    ("periods", "flow_ms = 1" + "0" * 400, "periods.flow_ms must be a number"),
    ("controller", "derivative_on_error = 0.9", "controller.derivative_on_error is one of 0, 1, not 0.9"),
    ("controller", "reset_in_rate_mode = 7", "controller.reset_in_rate_mode is one of 0, 1, not 7"),
    ("battery_compensation", "voltage_share = -3", "voltage_share must be more than 0 and at most 1"),
    ("battery_compensation", "voltage_share = 1.5", "voltage_share must be more than 0 and at most 1"),
    ("battery_compensation", "volts_of_grams = [1, 2, 3]", "volts_of_grams must be 2 numbers")])
def test_a_value_that_is_none_is_refused(section, line, message):
    with pytest.raises(AirTouchError) as error:
        settings.parse(f'base = "2026.08"\n[{section}]\n{line}\n', "mine.toml")
    assert message in str(error.value)


def test_whole_numbers_and_flags_in_other_words():
    row = settings.parse('base = "2026.08"\n[periods]\nrange_ms = 50.0\n[controller]\nreset_in_rate_mode = true\n',
                         "mine.toml")[0]
    assert row["periods"]["range_ms"] == 50 and row["controller"]["reset_in_rate_mode"] == 1
