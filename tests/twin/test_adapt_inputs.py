"""`airtouch adapt` and `at.adapt` refuse the same inputs with the same words, but for the names of arguments."""

import pytest
from click.testing import CliRunner

import airtouch as at
from airtouch.cli.learning.adapt import command
from airtouch.errors import AirTouchError


@pytest.fixture
def flights(tmp_path):
    """A folder with a file that is no flight."""
    folder = tmp_path / "flights"
    folder.mkdir()
    (folder / "bad.csv").write_text("1,2\n")
    return folder


@pytest.mark.parametrize("options, arguments, message", [
    ([], {}, r"no flight that can be trained on \(.*bad\.csv:.*\); fly straight over"),
    (["--twin", "t", "--vehicle", "crazyflie-2.1"], {"twin": "t", "vehicle": "crazyflie-2.1"},
     "a twin has a vehicle of its own; leave (--)?vehicle out")])
def test_both_refuse_with_the_same_words(flights, tmp_path, options, arguments, message):
    pytest.importorskip("tensorflow", reason="training needs the extra 'train'")
    out = tmp_path / "m.npz"
    result = CliRunner().invoke(command, [str(flights), "--out", str(out), *options])
    with pytest.raises(AirTouchError, match=message) as refusal:
        at.adapt(flights, out, **arguments)
    assert str(result.exception).replace("--", "") == str(refusal.value)
