"""The `airtouch` command: parse, call, print. Each sub-command loads only when it is called."""

import importlib
import io
import sys
from collections.abc import Mapping, Sequence

import click

from airtouch import __version__
from airtouch.errors import in_one_line, nearest

#: heading -> command -> (module in this package, one line of help)
SECTIONS = {
    "First": {
        "demo": ("demo", "Train, detect and report once: the whole pipeline in two minutes."),
        "gap": ("gap", "Diagnose the gap between real flights and the simulator (`gap demo`: one minute)."),
    },
    "Flights": {
        "logs": ("logs", "Look at, convert and check flight logs."),
        "dataset": ("dataset", "Fetch the authors' public flights."),
        "simulate": ("simulate", "Fly a scenario in the simulator and write flight logs."),
    },
    "Detectors": {
        "evaluate": ("evaluate", "Score a detector on flights with known edges."),
        "map": ("map", "Map the edges of a flight: plot and GeoJSON."),
        "train": ("learning.train", "Train a detector on recorded flights."),
        "adapt": ("learning.adapt", "Train a detector for the drone that flew some flights."),
        "twin": ("learning.twin", "Fit the simulator to recorded flights of one drone."),
        "crossval": ("learning.crossval", "Cross-validate a detector by flight."),
        "ablate": ("learning.ablate", "Find what each part of the detectors is worth."),
        "paper": ("paper", "Make the paper's tables and figures again, beside its own."),
        "export": ("learning.export", "Write a trained network, or a vehicle, as C for the drone."),
    },
    "Drone": {
        "sitl": ("drone.sitl", "Fly without a drone: a virtual Crazyflie that cflib connects to."),
        "collect": ("drone.collect", "Fly a mission with a Crazyflie and log it."),
        "monitor": ("drone.monitor", "Watch a Crazyflie live: signals, probability, edges."),
        "replay": ("drone.replay", "Show a recorded flight as it would look live."),
        "flash": ("drone.flash", "Check a firmware image and flash it."),
    },
}
#: words that a user may try -> commands that do it
MEANT = {"detect": ("map", "evaluate"), "score": ("evaluate",), "plot": ("map",), "fly": ("collect", "simulate"),
         "info": ("logs info",), "convert": ("logs convert",), "check": ("logs check",), "fetch": ("dataset fetch",),
         "diagnose": ("gap diagnose",), "measure": ("gap measure",)}
COMMANDS = {name: command for section in SECTIONS.values() for name, command in section.items()}


class Suggesting(click.Group):
    """A group of commands: it says in a whole line what each does, and suggests others for an unknown one.

    meant: commands that a word stands for; of any other word those with a similar name are suggested.
    """

    meant: Mapping[str, Sequence[str]] = {}

    def resolve_command(self, ctx: click.Context,
                        args: list[str]) -> tuple[str | None, click.Command | None, list[str]]:
        if args and self.get_command(ctx, args[0]) is None and not args[0].startswith("-"):
            meant = self.meant.get(args[0])
            suggested = (f"; did you mean {' or '.join(meant)}?" if meant
                         else nearest(args[0], self.list_commands(ctx)) or ".")
            ctx.fail(f"No such command {args[0]!r}{suggested}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        commands = {name: self.get_command(ctx, name) for name in self.list_commands(ctx)}
        with formatter.section("Commands"):
            formatter.write_dl([(name, command.get_short_help_str(limit=200)) for name, command in commands.items()
                                if command is not None])


class LazyGroup(Suggesting):
    """A group that imports a command's module when the command is called."""

    meant = MEANT

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:
        if name not in COMMANDS:
            return None
        module = importlib.import_module(f"airtouch.cli.{COMMANDS[name][0]}")
        return module.command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        width = max(len(name) for name in COMMANDS)  # not map: that is a module of this package
        for heading, commands in SECTIONS.items():
            with formatter.section(heading):
                formatter.write_dl([(name.ljust(width), text) for name, (_, text) in commands.items()])


@click.group(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="airtouch")
def airtouch() -> None:
    """AirTouch detects edges below a nano-quadcopter, and finds what a simulator of it gets wrong.

    Start with `airtouch gap demo` or `airtouch demo`; with flights of your own, with `airtouch logs info FLIGHT.csv`.
    """


def main() -> None:
    """Entry point. Bad input gives one line and exit code 2. Characters that a terminal lacks become escapes."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # a caller may have replaced it
            stream.reconfigure(errors="backslashreplace")
    with in_one_line("airtouch"):
        airtouch()
