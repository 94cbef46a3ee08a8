"""What is kept is made once, by kind and key; the least recently used goes first; a changed copy has nothing."""

from dataclasses import dataclass, field, replace

from airtouch.gap.workspace import Workspace


def counting():
    made = []

    def make(value):
        return lambda: made.append(value) or value
    return made, make


def test_a_value_is_made_once_for_a_kind_and_a_key():
    space, (made, make) = Workspace(), counting()
    assert [space.once("a", 1, make("x")), space.once("a", 1, make("y"))] == ["x", "x"]
    assert space.once("b", 1, make("z")) == "z"
    assert made == ["x", "z"]


def test_nothing_is_a_value_as_well():
    space, (made, make) = Workspace(), counting()
    assert space.once("a", 1, make(None)) is None and space.once("a", 1, make(None)) is None
    assert made == [None]


def test_the_least_recently_used_goes_first():
    space, (made, make) = Workspace(), counting()
    for key in (1, 2, 1, 3, 1, 2):
        space.once("a", key, make(key), most=2)
    assert made == [1, 2, 3, 2]


def test_a_changed_copy_of_its_owner_begins_with_nothing():
    @dataclass(frozen=True)
    class Owner:
        size: int
        workspace: Workspace = field(default_factory=Workspace, init=False, compare=False, repr=False)

    one = Owner(1)
    one.workspace.once("a", 1, lambda: "x")
    assert replace(one, size=2).workspace.once("a", 1, lambda: "y") == "y"
    assert one == Owner(1)
