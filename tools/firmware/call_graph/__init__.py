"""The deepest chain of calls in a firmware build, from the call graphs that GCC writes beside its objects."""

import re
from functools import cache
from pathlib import Path

#: line of a call graph: function, bytes of its frame
NODE = re.compile(r'node: \{ title: "([^"]+)" label: "[^"]*?(\d+) bytes \((\w+)')
#: line of a call graph: caller and callee
EDGE = re.compile(r'edge: \{ sourcename: "([^"]+)" targetname: "([^"]+)"')


def deepest(folder: Path, entry: str) -> tuple[int, list[str], set[str]]:
    """Bytes, the chain of functions, and the functions without a known frame that any chain ends in."""
    frames: dict[str, int] = {}
    calls: dict[str, set[str]] = {}
    for path in folder.rglob("*.ci"):
        text = path.read_text(errors="replace")
        frames.update((name, int(size)) for name, size, _ in NODE.findall(text))
        for source, target in EDGE.findall(text):
            calls.setdefault(source, set()).add(target)
    unknown: set[str] = set()
    above: list[str] = []

    @cache
    def depth(name: str) -> tuple[int, tuple[str, ...]]:
        """Bytes of the deepest chain from a function on, and its functions."""
        if name == "assertFail":
            return 0, (name,)
        if name not in frames:
            unknown.add(name)
            return 0, (name,)
        if name in above:
            unknown.add(f"{name} (calls itself)")
            return 0, (name,)
        above.append(name)
        below = max((depth(target) for target in calls.get(name, ())), default=(0, ()))
        above.pop()
        return frames[name] + below[0], (name, *below[1])

    start = next((name for name in frames if name == entry or name.endswith(f":{entry}")), None)
    if start is None:
        raise SystemExit(f"{folder}: no {entry} in any .ci file; build with -fcallgraph-info=su")
    size, chain = depth(start)
    return size, [name.rsplit(":", 1)[-1] for name in chain], unknown
