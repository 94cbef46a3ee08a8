"""The deepest chain of calls in synthetic call graphs whose frames are known."""

import sys

import pytest

from tools.firmware import stack
from tools.firmware.call_graph import deepest


def node(name, size):
    """A function with a frame, as GCC writes it."""
    return f'node: {{ title: "{name}" label: "{name}\\na.c:1:1\\n{size} bytes (static)\\n0 dynamic objects" }}\n'


def edge(caller, callee):
    return f'edge: {{ sourcename: "{caller}" targetname: "{callee}" label: "a.c:2:2" }}\n'


@pytest.fixture
def build(tmp_path):
    """main calls one and two; two calls three of another file; three calls a library and, when it fails, stops."""
    (tmp_path / "a.ci").write_text(
        node("a.c:main", 16) + node("one", 100) + node("two", 40) + edge("a.c:main", "one") + edge("a.c:main", "two")
        + edge("two", "three"))
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub/b.ci").write_text(
        node("three", 80) + node("assertFail", 5000) + edge("three", "memcpy") + edge("three", "assertFail"))
    return tmp_path


def test_frames_add_up_along_the_deepest_chain_over_files(build):
    """16 + 40 + 80 are more than 16 + 100; what follows a failed assertion does not count."""
    size, chain, unknown = deepest(build, "main")
    assert size == 136 and chain[:3] == ["main", "two", "three"] and unknown == {"memcpy"}


def test_a_function_that_calls_itself_is_named_and_counted_once(build):
    (build / "c.ci").write_text(edge("three", "two"))
    size, _, unknown = deepest(build, "main")
    assert size == 136 and "two (calls itself)" in unknown


def test_a_build_without_the_function_ends_it(build):
    with pytest.raises(SystemExit, match="fcallgraph-info"):
        deepest(build, "appMain")


def test_the_script_prints_the_chain_and_what_is_not_counted(build, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["stack.py", str(build), "main"])
    stack.main()
    first, second = capsys.readouterr().out.splitlines()
    assert first.startswith("136 bytes: main > two > three") and second == "not counted: memcpy"
