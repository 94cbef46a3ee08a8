"""The table of effects in host/docs/effects.md: `python -m airtouch.simulation.effects.table FILE`."""

import sys
from pathlib import Path

from airtouch.simulation.effects import EFFECTS, NAMES

BEGIN, END = "<!-- begin: python -m airtouch.simulation.effects.table -->", "<!-- end -->"


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


def updated(text: str) -> str:
    """A page with the part between BEGIN and END replaced."""
    before, _, rest = text.partition(BEGIN)
    _, _, after = rest.partition(END)
    return f"{before}{BEGIN}\n{table()}{END}{after}"


if __name__ == "__main__":
    page = Path(sys.argv[1])
    page.write_text(updated(page.read_text(encoding="utf-8")), encoding="utf-8")
