"""The table of nominal scatter: its classes, from the comparisons of nominal flights, and its text."""

import re
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from airtouch.gap.signatures.scatter import ApparentStrengths, Scatter, table
from airtouch.gap.signatures.scatter_estimates import class_scatter

from .comparisons import Task
from .groups import Group


def scatter_of_classes(groups: Sequence[Group], row_of: Mapping[str, dict], only: tuple[str, ...] = (),
                       ) -> tuple[dict[str, Scatter], dict[str, str]]:
    """Class -> its scatter, and class -> on how many flights it was measured, from the rows of `compare_all`.

    only: names of the effects that were measured, () for all.
    """
    flights, alike, names, flown_by = defaultdict(list), defaultdict(list), defaultdict(set), {}
    for group in groups:
        names[group.of].add(group.name)
        flown_by[group.of] = group.vehicle.name
        for task in (Task(group, only=only), Task(group, [], only=only)):
            files = [name + task.note for name, _ in group.logs]
            for row in (row_of[file] for file in files if file in row_of):
                flights[group.of].append(_apparent(row))
                if task.others is None:
                    alike[group.of].append(flights[group.of][-1])
    classes = {of: replace(class_scatter(all_of, alike[of]), vehicle=flown_by[of]) for of, all_of in flights.items()}
    counts = {of: f"{len(alike[of])} flights, {len(all_of)} comparisons in {len(names[of])} groups"
              for of, all_of in flights.items()}
    return classes, counts


def with_passing(tasks: Sequence[Task], row_of: Mapping[str, dict]) -> dict[str, Scatter]:
    """The classes of the table that is shipped, with the passing effects in the rows of `compare_all` of these tasks.
    """
    flights = defaultdict(list)
    for task in tasks:
        flights[task.group.of] += [_apparent(row_of[name + task.note]) for name, _ in task.group.logs]
    return {of: replace(one, passing=class_scatter(flights[of]).passing) for of, one in table().items()}


def with_effects(measured: Mapping[str, Scatter]) -> dict[str, Scatter]:
    """The classes of the table that is shipped, with the strengths of some effects as measured anew."""
    return {of: replace(one, rms={**one.rms, **measured[of].rms}, middle={**one.middle, **measured[of].middle})
            for of, one in table().items()}


def counts_of(text: str) -> dict[str, str]:
    """How many flights each class of a table was measured on, by its comments."""
    return dict(re.findall(r'^\["(.+)"\]  # (.+)$', text, re.MULTILINE))


def text_of(classes: Mapping[str, Scatter], counts: Mapping[str, str]) -> str:
    """The table as TOML."""
    lines = ["# Root mean square of the apparent strength of every effect, in its natural steps (term.Term), in",
             "# nominal flights held against others; made by tools/calibration/nominal_scatter.py.", ""]
    for name, s in classes.items():
        lines += [f'["{name}"]  # {counts[name]}', *([f'vehicle = "{s.vehicle}"'] if s.vehicle else []),
                  f"freedom = {s.freedom:g}", f"fourth_root_rate = [{s.rate[0]:.3f}, {s.rate[1]:.3f}]",
                  f'["{name}".passing]']
        lines += [f"{k} = [{mean:.3f}, {spread:.3f}]" for k, (mean, spread) in s.passing.items()]
        lines.append(f'["{name}".rms]')
        lines += [f"{k} = [{', '.join(f'{x:.4g}' for x in v)}]" for k, v in s.rms.items()]
        lines.append(f'["{name}".middle]')
        lines += [f"{k} = [{', '.join(f'{x:.4g}' for x in v)}]" for k, v in s.middle.items()]
        lines.append("")
    return "\n".join(lines)


def _apparent(row: dict) -> ApparentStrengths:
    """What a row of `compare_all` holds."""
    strengths, errors = ({k: np.array(v) for k, v in row[part].items()} for part in ("strengths", "errors"))
    return ApparentStrengths(strengths, errors, row["rate"], row["passing"])
