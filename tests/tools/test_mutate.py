"""The count of mutants: its groups are there, its shares are right. The mutants themselves: `make mutate`."""

import pytest

from tools import mutate


@pytest.mark.parametrize("name", mutate.GROUPS)
def test_every_module_and_test_of_a_group_is_there(name):
    group = mutate.GROUPS[name]
    assert all((mutate.ROOT / "host" / "airtouch" / module).is_file() for module in group.modules)
    assert all((mutate.ROOT / "tests" / test).exists() for test in group.tests)


def test_shares_of_mutants(capsys):
    codes = {"airtouch.a.x_f__mutmut_1": 1, "airtouch.a.x_f__mutmut_2": 0, "airtouch.b.x_g__mutmut_1": 33,
             "airtouch.b.x_g__mutmut_2": 36, "airtouch.b.x_g__mutmut_3": None}
    assert mutate.print_table(codes) == 0.5
    a, b, total = capsys.readouterr().out.splitlines()
    assert a.startswith("a: noticed 1 of 2, 50.0% [") and a.endswith("unnoticed 1")
    assert b.startswith("b: noticed 1 of 2") and b.endswith("reached by no test 1")
    assert total.startswith("all: noticed 2 of 4, 50.0% [15%, 85%]")


@pytest.mark.parametrize("sample", [[], ["--sample", "1"]])
@pytest.mark.parametrize("made", [True, False])
def test_a_run_of_mutmut_that_fails_is_no_count_of_mutants(made, sample, tmp_path, monkeypatch, capsys):
    """made: it fails in the tests of the unchanged code, with the mutants made; else before there are any."""
    def run_mutmut(place, *mutants):
        if made:
            (place / "mutants").mkdir(exist_ok=True)
            (place / "mutants/score.py.meta").write_text('{"exit_code_by_key": {"airtouch.a.x_f__mutmut_1": null}}')
        return 1

    monkeypatch.setattr(mutate, "find_spec", lambda name: name)
    monkeypatch.setattr(mutate, "stage", lambda name, force: tmp_path)
    monkeypatch.setattr(mutate, "run_mutmut", run_mutmut)
    assert mutate.main(["score", *sample]) == 1
    out, err = capsys.readouterr()
    assert not out and "mutmut failed on score with exit code 1" in err


def test_a_sample_runs_though_no_mutant_has_the_name_by_which_they_are_made(tmp_path, monkeypatch, capsys):
    """mutmut ends with 1 where it is asked for a mutant that there is not, but makes all of them before."""
    ran = []

    def run_mutmut(place, *mutants):
        ran.append(mutants)
        (place / "mutants").mkdir(exist_ok=True)
        codes = "null, null" if len(ran) == 1 else "1, null"
        first, second = codes.split(", ")
        (place / "mutants/score.py.meta").write_text(
            f'{{"exit_code_by_key": {{"airtouch.a.f_1": {first}, "airtouch.a.f_2": {second}}}}}')
        return int(len(ran) == 1)

    monkeypatch.setattr(mutate, "find_spec", lambda name: name)
    monkeypatch.setattr(mutate, "stage", lambda name, force: tmp_path)
    monkeypatch.setattr(mutate, "run_mutmut", run_mutmut)
    assert mutate.main(["score", "--sample", "2"]) == 0
    assert [len(mutants) for mutants in ran] == [1, 2]
    assert capsys.readouterr().out.startswith("score, 2 of 2 mutants:\na: noticed 1 of 1")


def test_a_group_that_is_none_is_named(capsys):
    with pytest.raises(SystemExit):
        mutate.main(["scores"])
    assert "no group scores; there are reference, int8, score, selection" in capsys.readouterr().err


def test_what_is_shown_must_have_been_run(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(mutate, "BUILD", tmp_path)
    with pytest.raises(SystemExit):
        mutate.main(["score", "--show"])
    assert "no mutants of score yet: leave out --show first" in capsys.readouterr().err
