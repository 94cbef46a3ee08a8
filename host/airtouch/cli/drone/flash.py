"""`airtouch flash`: an image onto the drone, after a look at it."""

from pathlib import Path

import click

from airtouch.crazyflie import flash


@click.command()
@click.argument("image", type=click.Path(path_type=Path))
@click.option("--uri", help="The running Crazyflie, radio://0/80/2M/E7E7E7E7E7 say; left out: cold boot.")
@click.option("--target", type=click.Choice(list(flash.TARGETS)), help="What the image is for; found out if left out.")
@click.option("--check", is_flag=True, help="Only look at the image.")
def command(image: Path, uri: str | None, target: str | None, check: bool) -> None:
    """Flash IMAGE (cf2.bin, or the GAP8's target.board.devices.flash.img) through cfloader.

    \b
    airtouch flash build/firmware/cf2.bin --uri radio://0/80/2M/E7E7E7E7E7
    airtouch flash target.board.devices.flash.img --uri radio://0/80/2M/E7E7E7E7E7
    """
    firmware = flash.inspect(image, target)
    click.echo(f"{firmware.path}: {firmware.target}, {firmware.size_bytes} bytes, entry 0x{firmware.entry:08x}")
    if not check:
        flash.flash(firmware, uri)
