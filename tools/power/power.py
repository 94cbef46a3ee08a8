"""Prints the paper's Table 1, measured: power of each stage from the logs of an INA219, beside the paper's figures.

    python tools/power/power.py measure run.csv                       # stages named in the log's own column
    python tools/power/power.py measure baseline=a.csv FC-FE=b.csv CCS-FF=c.csv filter=d.csv network=e.csv
    python tools/power/power.py estimate                              # no meter: from counted instructions, 2 s

A log has time, bus voltage and current in any order, which the header names (time_ms, bus_V, current_mA); without
one they are milliseconds, volts, milliamperes, as tools/power/ina219_logger.ino writes them. Each stage is
switched on beside those before it, so its power is what it adds. See host/docs/power.md.
"""

from pathlib import Path

import click

from airtouch.errors import AirTouchError, in_one_line
from airtouch.power.ina219 import Power, by_stage, canonical, parse, power
from airtouch.power.stages import BUDGETS, PAPER_MW, counts, estimate, estimate_table, table


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
def main() -> None:
    """The paper's Table 1 from INA219 logs, or an estimate of it."""


@main.command()
@click.argument("logs", nargs=-1, required=True)
def measure(logs: tuple[str, ...]) -> None:
    """LOGS: one file with a column of stages, or STAGE=FILE for each stage in the order in which they were
    added."""
    stages: dict[str, Power] = {}
    notes: list[str] = []
    for text in logs:
        name, equals, file = text.partition("=")
        path = Path(file if equals else text)
        try:
            trace = parse(path.read_text(encoding="utf-8", errors="replace"), str(path))
        except OSError as error:
            raise AirTouchError(f"{path}: cannot be read: {error.strerror}") from None
        notes += trace.notes
        known = tuple(PAPER_MW)
        of_trace = {canonical(name, known): power(trace)} if equals else by_stage(trace, known)
        if not of_trace:
            raise AirTouchError(f"{path}: no column of stages; give STAGE=FILE for each stage")
        stages |= of_trace
    click.echo(table(stages))
    click.echo("in brackets 95 % intervals, from means over blocks of 1 s; a step is 10 ms")
    for note in notes:
        click.echo(f"note: {note}", err=True)


@main.command("estimate")
@click.option("--budget", type=click.Path(path_type=Path), default=BUDGETS / "budget.toml",
              help="Counted instructions of each kernel on the STM32.")
@click.option("--gap8", type=click.Path(path_type=Path), default=BUDGETS / "gap8_budget.toml",
              help="Counted instructions of each network on the GAP8.")
def estimate_command(budget: Path, gap8: Path) -> None:
    """Without a meter: counted instructions times energy per instruction."""
    click.echo(estimate_table(estimate(counts(budget), counts(gap8))))


if __name__ == "__main__":
    with in_one_line("power"):
        main()
