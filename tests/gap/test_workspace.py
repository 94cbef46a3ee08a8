"""What is kept is made once, by kind and key; the least recently used goes first; a changed copy has nothing."""

import pickle
from dataclasses import dataclass, field, replace

from airtouch.gap.workspace import Workspace


def counting():
    values = []

    def make(value):
        return lambda: values.append(value) or value
    return values, make


def test_a_value_is_made_once_for_a_kind_and_a_key():
    space, (values, make_value) = Workspace(), counting()
    assert [space.cached("a", 1, make_value("x")), space.cached("a", 1, make_value("y"))] == ["x", "x"]
    assert space.cached("b", 1, make_value("z")) == "z"
    assert values == ["x", "z"]


def test_nothing_is_a_value_as_well():
    space, (values, make_value) = Workspace(), counting()
    assert space.cached("a", 1, make_value(None)) is None and space.cached("a", 1, make_value(None)) is None
    assert values == [None]


def test_the_least_recently_used_goes_first():
    space, (values, make_value) = Workspace(), counting()
    for key in (1, 2, 1, 3, 1, 2):
        space.cached("a", key, make_value(key), most=2)
    assert values == [1, 2, 3, 2]


def test_a_changed_copy_of_its_owner_begins_with_nothing():
    @dataclass(frozen=True)
    class Owner:
        size: int
        workspace: Workspace = field(default_factory=Workspace, init=False, compare=False, repr=False)

    owner = Owner(1)
    owner.workspace.cached("a", 1, lambda: "x")
    assert replace(owner, size=2).workspace.cached("a", 1, lambda: "y") == "y"
    assert owner == Owner(1)


def test_one_that_is_sent_to_another_process_begins_with_nothing():
    space = Workspace()
    space.cached("a", 1, lambda: bytes(10 ** 6))
    sent = pickle.dumps(space)
    assert len(sent) < 100 and pickle.loads(sent).cached("a", 1, lambda: "y") == "y"
