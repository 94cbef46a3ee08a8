"""The command line of `python -m tools.firmware_emulation`: what it takes, and what it refuses before it builds."""

import argparse
from pathlib import Path
from typing import NoReturn

from airtouch.cli.shared.arguments import whole_number
from airtouch.errors import AirTouchError
from airtouch.logs import read
from airtouch.logs.files import check_free, make_folder
from airtouch.logs.flight_log import FlightLog

from . import build, missions
from .replay import VEHICLES, rows

#: what is said where the checkout is not given
NO_BASE = f"say where the firmware's sources are: make emulate CRAZYFLIE_BASE=~/crazyflie-firmware; {build.CLONE}"


class Parser(argparse.ArgumentParser):
    """Says in one line what is wrong with the command."""

    def error(self, message: str) -> NoReturn:
        """AirTouchError in place of a usage of seven lines."""
        if "arguments are required" in message:
            raise AirTouchError(NO_BASE)
        raise AirTouchError(f"{message}; see python -m tools.firmware_emulation --help")


def parser(description: str | None) -> argparse.ArgumentParser:
    """What the command takes. An option that is not given is None or False, so that `fits` can refuse it where it
    has no part."""
    arguments = Parser(prog="python -m tools.firmware_emulation", description=description,
                       formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("base", type=Path, help="checkout of bitcraze/crazyflie-firmware")
    arguments.add_argument("flights", nargs="*", type=Path, help="flight logs; recorded ones if left out")
    what = arguments.add_mutually_exclusive_group()
    what.add_argument("--fly", action="store_true", help="closed loop with the simulator instead: the app on and off")
    what.add_argument("--height", action="store_true",
                      help="closed loop over edges of every kind: the height kept or not")
    what.add_argument("--gap8", action="store_true",
                      help="a recorded flight with the AI-deck's driver, the network on the GAP8, and faults")
    arguments.add_argument("--steps", type=whole_number(1), help="of each recorded flight (2400)")
    arguments.add_argument("--begin", type=whole_number(0), help="first row of each recorded flight (0)")
    arguments.add_argument("--seeds", type=whole_number(1), help="of --fly and --height: draws of the noise (1)")
    arguments.add_argument("--traces", type=Path, help="of --fly: CSV for the first flight and the simulator's own")
    arguments.add_argument("--force", action="store_true", help="of --traces: overwrite the file")
    arguments.add_argument("--only", help="of --height: cases whose names begin so")
    arguments.add_argument("--keep", type=Path, help="of --height: folder of its flights; those that are there are not "
                                                     "flown again, unless the image or the mission has changed")
    arguments.add_argument("--built", action="store_true", help="take what `make firmware` built last")
    arguments.add_argument("--config", help="of firmware/app: app-config-tap and the like")
    arguments.add_argument("--platform", choices=VEHICLES, help="of the firmware (cf2)")
    return arguments


def fits(options: argparse.Namespace) -> None:
    """AirTouchError for an option that would have no effect."""
    closed, begun = options.fly or options.height, f"--{'fly' if options.fly else 'height'}"
    if options.flights and closed:
        raise AirTouchError(f"{begun} flies the simulator's drone: leave out {options.flights[0]}")
    if options.gap8 and len(options.flights) > 1:
        raise AirTouchError(f"--gap8 takes one flight: leave out {options.flights[1]}")
    if options.gap8 and options.platform not in (None, "cf2"):
        raise AirTouchError(f"--gap8 compares the networks of the cf2: leave out --platform {options.platform}")
    for name, of in (("traces", "fly"), ("only", "height"), ("keep", "height")):
        if getattr(options, name) is not None and not getattr(options, of):
            raise AirTouchError(f"--{name} is of --{of}: add it, or leave out --{name}")
    for name in ("steps", "begin"):
        if closed and getattr(options, name) is not None:
            raise AirTouchError(f"--{name} is of a recorded flight, and {begun} flies none: leave it out")
    if options.seeds is not None and not closed:
        raise AirTouchError("--seeds is of --fly and --height, a recorded flight has one noise: leave it out")
    if options.force and not options.traces:
        raise AirTouchError("--force is of --traces: leave it out")
    for name in ("config", "platform"):
        if options.built and getattr(options, name) is not None:
            raise AirTouchError(f"--built takes what was built last: leave out --{name}")
    for name in ("height", "gap8"):
        if getattr(options, name) and options.config and name not in options.config:
            raise AirTouchError(f"--{name} needs app-config-{name}: leave out --config {options.config}")


def flights_of(options: argparse.Namespace) -> list[FlightLog]:
    """The flights of the command line from --begin on. AirTouchError, before anything is built, for what cannot be
    run."""
    fits(options)
    check_free(options.traces, options.force)
    options.begin, options.steps, options.seeds = options.begin or 0, options.steps or 2400, options.seeds or 1
    options.only, options.platform = options.only or "", options.platform or "cf2"
    missions.cases(options.only)
    if options.keep:
        make_folder(options.keep)
    logs = [from_row(read(path), options.begin) for path in options.flights]
    for log in logs:
        rows(log)
    return logs


def from_row(log: FlightLog, begin: int) -> FlightLog:
    """The log from this row on. AirTouchError where it has none."""
    if begin >= len(log):
        raise AirTouchError(f"{log.meta.get('source', 'the flight')} has {len(log)} rows: --begin must be less")
    return FlightLog({name: values[begin:] for name, values in log.columns.items()}, log.meta)
