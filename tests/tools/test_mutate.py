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
    assert mutate.table(codes) == 0.5
    a, b, total = capsys.readouterr().out.splitlines()
    assert a.startswith("a: noticed 1 of 2, 50.0% [") and a.endswith("unnoticed 1")
    assert b.startswith("b: noticed 1 of 2") and b.endswith("reached by no test 1")
    assert total.startswith("all: noticed 2 of 4, 50.0% [15%, 85%]")


def test_a_group_that_is_none_is_named(capsys):
    with pytest.raises(SystemExit):
        mutate.main(["scores"])
    assert "no group scores; there are reference, int8, score, selection" in capsys.readouterr().err


def test_what_is_shown_must_have_been_run(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(mutate, "BUILD", tmp_path)
    with pytest.raises(SystemExit):
        mutate.main(["score", "--show"])
    assert "no mutants of score yet: leave out --show first" in capsys.readouterr().err
