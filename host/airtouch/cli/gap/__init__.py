"""`airtouch gap`: where real flights and the simulator part, why, and how far an effect closes it."""

import os

import click

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # its threads wait for one another: products are small

from airtouch.cli import Suggesting
from airtouch.cli.gap.blind import blind
from airtouch.cli.gap.demo import demo_command
from airtouch.cli.gap.diagnose import diagnose_command
from airtouch.cli.gap.measure import measure_command


@click.group("gap", cls=Suggesting)
def command() -> None:
    """Diagnose the gap between recorded flights and the simulator."""


for _one in (measure_command, diagnose_command, demo_command, blind):
    command.add_command(_one)
