"""What the STM32 app adds to the firmware: flash, RAM and CCM of stock images and of those with AirTouch.

    python tools/firmware_sizes.py ~/crazyflie-firmware

Builds every image of IMAGES with the firmware's own makefiles (a minute each), those with AirTouch through
`make firmware`, and prints the table of host/docs/flash.md. Stops at a compiler's warning.
"""

import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PLATFORMS = ("cf2", "cf21bl")
#: configuration of firmware/app, platform, further arguments of `make firmware`
IMAGES = (("app-config", "cf2", ()), ("app-config-tap", "cf2", ()), ("app-config-gap8", "cf2", ()),
          ("app-config", "cf21bl", ("NETWORKS=no",)))
REPORT = re.compile(r"(Flash|RAM|CCM)\s*\|\s*(\d+)/(\d+)")


@dataclass(frozen=True)
class Sizes:
    """Bytes used in each memory, and bytes there are."""

    used: dict[str, int]
    room: dict[str, int]


def parse(output: str) -> Sizes:
    """The sizes that the firmware's makefile prints at its end."""
    found = {name: (int(used), int(room)) for name, used, room in REPORT.findall(output)}
    if set(found) != {"Flash", "RAM", "CCM"}:
        raise SystemExit("the firmware's makefile printed no sizes")
    return Sizes({name: used for name, (used, _) in found.items()}, {name: room for name, (_, room) in found.items()})


def made(*command: object) -> str:
    """Standard output of a build that must succeed without a warning."""
    run = subprocess.run([str(c) for c in command], cwd=ROOT, capture_output=True, text=True)
    if run.returncode != 0 or "warning:" in run.stderr:
        raise SystemExit(f"{' '.join(map(str, command))}:\n{run.stderr[-3000:]}")
    return run.stdout


def stock(base: Path, platform: str) -> Sizes:
    """The firmware as it is."""
    out = ROOT / "build" / "stock" / platform
    made("make", "-C", base, f"KBUILD_OUTPUT={out}", f"{platform}_defconfig")
    made("rm", "-f", out / f"{platform}.elf", out / "firmware")
    return parse(made("make", "-C", base, f"KBUILD_OUTPUT={out}"))


def row(what: str, sizes: Sizes, plain: Sizes) -> str:
    """One line of the table; without what is added for the stock image itself."""
    kilo = [f"{sizes.used[name] / 1000:.1f}" for name in ("Flash", "RAM", "CCM")]
    added = [f"{(sizes.used[name] - plain.used[name]) / 1000:+.1f}" for name in ("Flash", "RAM", "CCM")]
    left = [f"{(sizes.room[name] - sizes.used[name]) / 1000:.1f}" for name in ("Flash", "RAM", "CCM")]
    return f"| {what} | {' / '.join(kilo)} | {'' if sizes is plain else ' / '.join(added)} | {' / '.join(left)} |"


def networks() -> int:
    """Bytes of flash that the two networks' constants take in the last build."""
    listed = made("arm-none-eabi-size", *sorted((ROOT / "build/firmware/gap8/model").glob("*.o"))).splitlines()[1:]
    return sum(int(text) + int(data) for text, data, *_ in (line.split() for line in listed))


def main(base: Path) -> None:
    """Build and print."""
    plain = {platform: stock(base, platform) for platform in PLATFORMS}
    print("| image | flash / RAM / CCM, kB | added to stock | left |\n|---|---|---|---|")
    for platform in PLATFORMS:
        print(row(f"{platform}, stock", plain[platform], plain[platform]))
        for config, flown, further in IMAGES:
            if flown == platform:
                text = made("make", "firmware", f"CRAZYFLIE_BASE={base}", f"CONFIG={config}", f"PLATFORM={platform}",
                            *further)
                print(row(f"{platform}, `{config}`", parse(text), plain[platform]), flush=True)
    print(f"\nThe two networks are {networks() / 1000:.1f} kB of the flash.")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        raise SystemExit(__doc__)
    main(Path(sys.argv[1]).expanduser().resolve())
