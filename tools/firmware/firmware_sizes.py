"""Prints what the STM32 app adds to the firmware: flash, RAM and CCM of stock images and of those with AirTouch.

    python tools/firmware/firmware_sizes.py ~/crazyflie-firmware

Builds each of IMAGES with the firmware's own makefiles (over a minute each), those with AirTouch through
`make firmware`, and prints the table of host/docs/flash.md. Stops at a compiler's warning.
"""

import argparse
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from call_graph import deepest

ROOT = Path(__file__).resolve().parents[2]  #: of the checkout
OUT = ROOT / "build" / "firmware"  #: of `make firmware`
#: configuration of firmware/app, platform, further arguments of `make firmware`
IMAGES = (("app-config", "cf2", ()), ("app-config-tap", "cf2", ()), ("app-config-gap8", "cf2", ()),
          ("app-config", "cf21bl", ("NETWORKS=no",)))
MEMORIES = ("Flash", "RAM", "CCM")  #: as the firmware's makefile names them
#: a line of its report: memory, bytes used, bytes that there are
REPORT = re.compile(r"(Flash|RAM|CCM)\s*\|\s*(\d+)/(\d+)")


@dataclass(frozen=True)
class Sizes:
    """Bytes used of each of MEMORIES, and bytes that there are."""

    used: tuple[int, ...]
    room: tuple[int, ...]


def parse(output: str) -> Sizes:
    """The sizes that the firmware's makefile prints at its end; SystemExit where it printed none."""
    regions = {name: (int(used), int(room)) for name, used, room in REPORT.findall(output)}
    if set(regions) != set(MEMORIES):
        raise SystemExit("the firmware's makefile printed no sizes")
    return Sizes(*zip(*(regions[name] for name in MEMORIES), strict=True))


def row(what: str, sizes: Sizes, stock: Sizes | None = None, stack: int | None = None) -> str:
    """One line of the table; stock and deepest stack of the app are left out for a stock image."""
    used = " / ".join(f"{bytes_ / 1000:.1f}" for bytes_ in sizes.used)
    free = " / ".join(f"{(room - bytes_) / 1000:.1f}" for bytes_, room in zip(sizes.used, sizes.room, strict=True))
    added = " / ".join(f"{(a - b) / 1000:+.1f}" for a, b in zip(sizes.used, stock.used, strict=True)) if stock else ""
    return f"| {what} | {used} | {added} | {free} | {'' if stack is None else stack} |"


def build_output(*command: object) -> str:
    """Standard output of a build that must succeed without a warning."""
    print(*command, file=sys.stderr)
    run = subprocess.run([str(c) for c in command], cwd=ROOT, capture_output=True, text=True)
    if run.returncode != 0 or "warning:" in run.stderr:
        raise SystemExit(f"{' '.join(map(str, command))}:\n{run.stderr[-3000:]}")
    return run.stdout


def plain(base: Path, platform: str) -> Sizes:
    """The firmware as it is."""
    out = ROOT / "build" / "stock" / platform
    build_output("make", "-C", base, f"KBUILD_OUTPUT={out}", f"{platform}_defconfig")
    return parse(build_output("make", "-C", base, f"KBUILD_OUTPUT={out}"))


def networks() -> int:
    """Bytes of flash that the two networks take in the last build."""
    objects = sorted((OUT / "gap8/model").glob("*.o"))
    lines = build_output("arm-none-eabi-size", *objects).splitlines()[1:]
    return sum(int(text) + int(data) for text, data, *_ in (line.split() for line in lines))


def main() -> None:
    """Build and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("base", type=Path, help="checkout of bitcraze/crazyflie-firmware")
    base = parser.parse_args().base.expanduser().resolve()
    if not (base / "tools" / "make" / "oot.mk").is_file():
        parser.error(f"{base} is no checkout of bitcraze/crazyflie-firmware (no tools/make/oot.mk)")
    print("| image | flash / RAM / CCM | added to stock | left | deepest stack of the app, bytes "
          "|\n|---|---|---|---|---|")
    for platform in dict.fromkeys(platform for _, platform, _ in IMAGES):
        stock = plain(base, platform)
        print(row(f"{platform}, stock", stock), flush=True)
        for config, _, further in (image for image in IMAGES if image[1] == platform):
            text = build_output("make", "firmware", f"CRAZYFLIE_BASE={base}", f"CONFIG={config}",
                                f"PLATFORM={platform}", *further)
            stack, _, _ = deepest(OUT, "appMain")
            print(row(f"{platform}, `{config}`", parse(text), stock, stack), flush=True)
    print(f"\n{networks() / 1000:.1f} kB of the flash are the two networks.")


if __name__ == "__main__":
    main()
