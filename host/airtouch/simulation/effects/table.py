"""The tables of effects, signals and plant fields in host/docs/effects.md:
`python -m airtouch.simulation.effects.table FILE`."""

import argparse
import inspect
import re
from pathlib import Path

from airtouch.simulation import plant, signals
from airtouch.simulation.effects import EFFECTS, NAMES

BEGIN, END = "<!-- begin: python -m airtouch.simulation.effects.table -->", "<!-- end -->"
BEGIN_NAMES, END_NAMES = "<!-- begin: signals and fields, by the same command -->", "<!-- end of signals and fields -->"


def table() -> str:
    """A Markdown section for each effect of the package."""
    lines = []
    for name in NAMES:
        effect = EFFECTS[name]
        lines += [f"### {name}", f"{effect.summary[0].upper()}{effect.summary[1:]}.", "",
                  "| parameter | unit | default | from | to | changes nothing at | meaning | source |",
                  "|---|---|---|---|---|---|---|---|"]
        for p in effect.parameters:
            neutral = "" if p.neutral is None else f"{p.neutral:g}"
            cells = (p.name, p.unit, f"{p.default:g}", f"{p.low:g}", f"{p.high:g}", neutral, p.summary,
                     p.source)
            lines.append("| " + " | ".join(cells) + " |")
        lines += ["", *(f"Preset `{name}`: {', '.join(f'{k} {v:g}' for k, v in values.items())}."
                        for name, values in effect.presets.items())]
        lines += [""] if effect.presets else []
    return "\n".join(lines)


def names_table() -> str:
    """Markdown tables of the signals that a wrench may read and of the plant fields that settings may change."""
    lines = ["| signal | numbers | unit and meaning |", "|---|---|---|"]
    for name, count, text in signal_rows():
        lines.append(f"| `at.{name}` | {count} | {text} |")
    lines += ["", "| plant field | numbers | where the vehicle says nothing | unit and meaning |", "|---|---|---|---|"]
    lines += [f"| `{name}` | {count} | {default:g} | {text} |" for name, count, default, text in plant.FIELDS]
    return "\n".join(lines) + "\n"


def signal_rows() -> list[tuple[str, int, str]]:
    """Name, how many numbers, and meaning of every signal, as `simulation/signals.py` says them."""
    rows = []
    for name, text in re.findall(r"^([A-Z_]+) = \d+  #: (.*)$", inspect.getsource(signals), re.M):
        if name == "COUNT":
            continue
        many = re.match(r"(\d+)(?:, (.*))?$", text)
        rows.append((name, int(many[1]) if many else 1, (many[2] or "") if many else text))
    return rows


def updated(text: str) -> str:
    """A page with the parts between the marks replaced."""
    return _between(_between(text, BEGIN, END, table()), BEGIN_NAMES, END_NAMES, names_table())


def _between(text: str, begin: str, end: str, middle: str) -> str:
    before, _, rest = text.partition(begin)
    _, _, after = rest.partition(end)
    return f"{before}{begin}\n{middle}{end}{after}"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("page", type=Path, help="host/docs/effects.md: the parts between its marks are replaced")
    page = parser.parse_args().page
    page.write_text(updated(page.read_text(encoding="utf-8")), encoding="utf-8")
