"""Writes host/docs/api.md: every public function of `airtouch` and `airtouch.gap`, from its signature and docstring.

    python tools/pages/api_page.py    # under a second
"""

import argparse
import inspect
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import airtouch
import airtouch.gap
from airtouch.logs.files import write_bytes

PAGE = Path(__file__).parents[2] / "host/docs/api.md"
HEAD = """# API
After this page you know what each function of `import airtouch as at` takes, returns and raises. Examples, and how to
begin: [from Python](python.md). `python tools/pages/api_page.py` makes this page from the docstrings.
"""
WIDTH = 100  #: characters from which a signature is written with a line for each argument


def functions() -> dict[str, Callable[..., Any]]:
    """The public functions, by the name that a reader types."""
    names = {f"at.{name}": getattr(airtouch, name) for name in airtouch.__all__}
    names |= {f"at.gap.{name}": getattr(airtouch.gap, name) for name in airtouch.gap.__all__}
    return {name: function for name, function in sorted(names.items()) if inspect.isfunction(function)}


def typed(annotation: Any) -> str:
    """A type as the code writes it: without quotes, and `Path`, not where that is defined."""
    text = annotation if isinstance(annotation, str) else inspect.formatannotation(annotation)
    return re.sub(r"(?:\w+\.)+(?=\w)", "", text)


def signature(name: str, function: Callable[..., Any]) -> str:
    """The call with its types and defaults, on one line where it fits."""
    own = inspect.signature(function)
    arguments = []
    for p in own.parameters.values():
        if p.kind is p.KEYWORD_ONLY and "*" not in arguments:
            arguments.append("*")
        arguments.append(f"{p.name}: {typed(p.annotation)}" + ("" if p.default is p.empty else f" = {p.default!r}"))
    result = f" -> {typed(own.return_annotation)}"
    line = f"{name}({', '.join(arguments)}){result}"
    return line if len(line) <= WIDTH else f"{name}(\n    " + ",\n    ".join(arguments) + f",\n){result}"


def page() -> str:
    """The whole page."""
    parts = [HEAD]
    for name, function in functions().items():
        parts.append(f"## {name}\n```text\n{signature(name, function)}\n```\n{inspect.getdoc(function)}\n")
    return "\n".join(parts)


def main() -> None:
    """Write the page."""
    argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter).parse_args()
    write_bytes(page().encode(), PAGE, force=True)
    print(f"written: {PAGE}")


if __name__ == "__main__":
    main()
