"""A sealed set that is made again, broken off or asked for with other numbers: no flight meets another set's key."""

import pytest
from click.testing import CliRunner

from airtouch.cli.gap import command
from airtouch.errors import AirTouchError
from airtouch.gap.sealed import key as blind_key
from airtouch.gap.sealed import make as blind
from airtouch.gap.sealed import run as blind_run


def broken_off(*_):
    raise KeyboardInterrupt


def sealed_set(folder, flights=2, seed=5):
    """A folder with the files of a set, and its key beside it; the flights are empty."""
    folder.mkdir()
    for name in (*(f"cal_{i}" for i in range(blind.CAL)), *(f"flight_{i:04d}" for i in range(flights))):
        (folder / f"{name}.csv.gz").touch()
    drawn = {f"flight_{i:04d}": blind_key.DrawnFlight(()) for i in range(flights)}
    blind_key.seal(folder, blind_key.key_path(folder), blind_key.Key(drawn, {}, {"salt": "x", "seed": seed}), blind.CAL)
    return folder


def test_a_set_whose_replacement_is_broken_off_has_no_seal_and_no_key(tmp_path, monkeypatch):
    folder = sealed_set(tmp_path / "set")
    monkeypatch.setattr(blind, "nominal", broken_off)
    with pytest.raises(KeyboardInterrupt):
        blind.make(folder, 3, force=True)
    assert not (folder / "sealed.json").exists() and not blind_key.key_path(folder).exists()


def test_answers_to_the_flights_of_an_older_set_go_with_it(tmp_path, monkeypatch):
    folder = sealed_set(tmp_path / "set")
    (folder / "answers").mkdir()
    for name in ("flight_0001.json", "flight_0001.without.mass.json", "notes.json"):
        (folder / "answers" / name).touch()
    monkeypatch.setattr(blind, "nominal", broken_off)
    with pytest.raises(KeyboardInterrupt):
        blind.make(folder, 3, force=True)
    assert [p.name for p in (folder / "answers").iterdir()] == ["notes.json"]


def test_flights_of_a_set_that_was_broken_off_make_room(tmp_path, monkeypatch):
    """Left there, `run` would diagnose them with the flights of a smaller set and not find them in its key."""
    folder = tmp_path / "set"

    def break_off(out):
        with pytest.raises(KeyboardInterrupt):
            blind.make(out, 3)

    monkeypatch.setattr(blind, "nominal", broken_off)
    break_off(folder)
    for name in ("flight_0000.csv.gz", "cal_0.csv.gz", "flight_own.csv.gz"):
        (folder / name).touch()
    break_off(folder)
    assert [p.name for p in folder.glob("*.gz")] == ["flight_own.csv.gz"]


def test_flights_that_no_set_began_stay(tmp_path):
    own = tmp_path / "flight_0000.csv.gz"
    own.touch()
    with pytest.raises(AirTouchError, match="--force"):
        blind.make(tmp_path, 3)
    assert own.exists()


def test_a_folder_with_more_flights_than_were_sealed_is_refused_before_the_key_is_opened(tmp_path):
    folder = sealed_set(tmp_path / "set", flights=2)
    (folder / "flight_0002.csv.gz").touch()
    with pytest.raises(AirTouchError, match="3 flights, but 2 were sealed"):
        blind_run.run(folder)
    assert not (folder / "opened.json").exists()


@pytest.mark.parametrize(("asked", "says"), [(["--flights", "500"], "flights 2 is there, not 500"),
                                             (["--seed", "99"], "seed 5 is there, not 99")])
def test_other_numbers_than_those_of_the_set_are_refused(tmp_path, monkeypatch, asked, says):
    folder = sealed_set(tmp_path / "set", flights=2, seed=5)
    result = CliRunner().invoke(command, ["blind", "run", str(folder), *asked])
    assert isinstance(result.exception, AirTouchError) and says in str(result.exception)


@pytest.mark.parametrize("asked", [[], ["--flights", "2", "--seed", "5"]])
def test_the_numbers_of_the_set_or_none_go_on(tmp_path, monkeypatch, asked):
    folder = sealed_set(tmp_path / "set", flights=2, seed=5)
    monkeypatch.setattr(blind_run, "study_in", broken_off)
    assert "is there" not in str(CliRunner().invoke(command, ["blind", "run", str(folder), *asked]).exception)
    with pytest.raises(KeyboardInterrupt):  # it came as far as the study
        blind_run.run(folder, *map(int, asked[1::2]))


def test_a_key_elsewhere_is_asked_for_before_any_flight_is_diagnosed(tmp_path, monkeypatch):
    """Every flight was diagnosed first, and the remedy named an option that there was not."""
    folder, elsewhere = sealed_set(tmp_path / "set", flights=2, seed=5), tmp_path / "elsewhere.json"
    blind_key.key_path(folder).rename(elsewhere)
    monkeypatch.setattr(blind_run, "study_in", broken_off)  # with which diagnosing begins

    def said(*options):
        return CliRunner().invoke(command, ["blind", "run", str(folder), *options])

    assert "the key cannot be read: No such file or directory; name it with --key" in str(said().exception)
    assert "seed 5 is there, not 99" in str(said("--key", str(elsewhere), "--seed", "99").exception)
    (tmp_path / "other.json").write_text("{}")
    assert "not the key that was sealed" in str(said("--key", str(tmp_path / "other.json")).exception)
    result = said("--key", str(elsewhere), "--seed", "5")
    assert not isinstance(result.exception, AirTouchError) and result.exit_code == 1  # it came as far as the study
    with pytest.raises(KeyboardInterrupt):
        blind_run.run(folder, key=elsewhere)
    assert not (folder / "opened.json").exists() and not list(folder.glob("answers/*"))


def test_run_makes_a_set_with_its_key_where_it_is_asked_for(tmp_path, monkeypatch):
    asked = []

    def made(*_, key, **__):
        asked.append(key)
        raise KeyboardInterrupt

    monkeypatch.setattr(blind_run.make, "make", made)
    with pytest.raises(KeyboardInterrupt):
        blind_run.run(tmp_path, key=tmp_path / "elsewhere.json")
    assert asked == [tmp_path / "elsewhere.json"]


def test_a_damaged_record_of_the_opening_is_told(tmp_path):
    folder = sealed_set(tmp_path / "set")
    for content in ("", "[]", "{}"):
        (folder / "opened.json").write_text(content)
        with pytest.raises(AirTouchError, match="damaged"):
            blind_key.open_key(folder, "")


def test_a_kind_that_there_is_not_is_told(tmp_path):
    with pytest.raises(AirTouchError, match="mas: no kind"):
        blind.make(tmp_path / "set", 3, kinds=["mass", "mas"])
    assert not (tmp_path / "set").exists()


def test_too_few_nominal_flights_are_told(monkeypatch):
    monkeypatch.setattr(blind, "flown", lambda *_, **__: iter([None] * 20))
    with pytest.raises(AirTouchError, match="0 end well, fewer than 2"):
        blind.nominal(None, 0, 2, 0)
