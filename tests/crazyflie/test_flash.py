"""Images are looked at before they are flashed; cfloader gets what it wants."""

import struct
import sys

import pytest
from click.testing import CliRunner

from airtouch.cli.drone import flash as cli
from airtouch.crazyflie import flash
from airtouch.errors import AirTouchError

URI = "radio://0/80/2M/E7E7E7E7E7"


def stm32(size=40_000, stack=0x2001_FFFF, reset=0x0800_4101, **vectors):
    table = [stack, reset, 0x0800_4201, 0x0800_4201] + [0] * 12
    for number, value in vectors.items():
        table[int(number[1:])] = value
    return struct.pack("<16I", *table) + bytes(size - 64)


def gap8(segments=((1024, 0x1C00_0100, 3000),), entry=0x1C00_0180, size=None, count=None):
    header = struct.pack("<4I", size or 8000, len(segments) if count is None else count, entry, 0x1C00_0000)
    header += b"".join(struct.pack("<4I", *segment, 1) for segment in segments)
    return header + bytes(8000 - len(header))


@pytest.fixture
def image(tmp_path):
    def write(data, name="image.bin"):
        path = tmp_path / name
        path.write_bytes(data)
        return path

    return write


def test_good_images_are_known_by_what_they_are(image):
    kind = flash.inspect(image(stm32()))
    assert (kind.target, kind.size_bytes, kind.entry) == ("stm32", 40_000, 0x0800_4100)
    kind = flash.inspect(image(gap8(), "any.name"))
    assert (kind.target, kind.entry) == ("gap8", 0x1C00_0180)


@pytest.mark.parametrize("data, words", [
    (stm32(size=1000), "1000 bytes; a firmware has"),
    (stm32(size=1_100_000), "1100000 bytes; a firmware has"),
    (stm32(stack=0x0800_0000), "the stack would start at 0x08000000, outside RAM"),
    (stm32(reset=0x0800_0101), "vector 1 points to 0x08000101"),  # linked for a drone without its bootloader
    (stm32(reset=0x0800_4100), "vector 1 points to 0x08004100"),  # not Thumb
    (stm32(reset=0x0800_FFFF), "vector 1 points to"),             # cut off
    (stm32(v3=0), "vector 3 points to 0x00000000"),
    (stm32(v11=0x2000_0001), "vector 11 points to"),
    (b"\x7fELF" + bytes(40_000), "an ELF or HEX file; flash the .bin beside it"),
    (b":020000040800F2\n" + bytes(40_000), "an ELF or HEX file"),
    (gap8() + bytes(20_000), "no Crazyflie firmware"),
])
def test_what_is_no_firmware_is_refused_with_its_reason(image, data, words):
    with pytest.raises(AirTouchError, match=words):
        flash.inspect(image(data), "stm32")


@pytest.mark.parametrize("data, words", [
    (b"", "0 bytes; a GAP8 image has"),
    (gap8(count=0), "names 0 segments"),
    (gap8(count=17), "names 17 segments"),
    (gap8(size=9000), "no GAP8 flash image"),
    (gap8()[:7000], "no GAP8 flash image"),
    (gap8(((1024, 0x1C00_0100, 30_000),)), "truncated: segment 0"),
    (gap8(((1024, 0x1C05_FF00, 3000),)), "outside the GAP8's memory or over its bootloader"),
    (gap8(((1024, 0x2000_0000, 3000),)), "outside the GAP8's memory"),
    (gap8(entry=0x1000), "entry at 0x00001000, outside L2"),
    (stm32(), "no GAP8 flash image"),
])
def test_what_is_no_gap8_image_is_refused_with_its_reason(image, data, words):
    with pytest.raises(AirTouchError, match=words):
        flash.inspect(image(data), "gap8")


def test_neither_one_nor_the_other(image, tmp_path):
    with pytest.raises(AirTouchError, match="neither a Crazyflie firmware"):
        flash.inspect(image(bytes(50_000)))
    with pytest.raises(AirTouchError, match="No such file.*make firmware"):
        flash.inspect(tmp_path / "absent.bin")
    with pytest.raises(AirTouchError, match="'nrf51' is none of stm32, gap8"):
        flash.inspect(image(stm32()), "nrf51")


def test_cfloader_is_called_as_it_says_it_wants(image):
    path = image(stm32())
    assert flash.command(flash.inspect(path), URI) == [
        sys.executable, "-m", "cfloader", "flash", str(path), "stm32-fw", "-w", URI]
    assert flash.command(flash.inspect(path), None)[-1] == "-c"
    path = image(gap8())
    assert "deck-bcAI:gap8-fw" in flash.command(flash.inspect(path), URI)
    with pytest.raises(AirTouchError, match="give --uri"):
        flash.flash(flash.inspect(path), None)


@pytest.mark.parametrize("data, hint", [(stm32(), False), (gap8(), True)], ids=["stm32", "gap8"])
def test_where_cfloader_fails_its_exit_code_is_told(image, data, hint, monkeypatch):
    monkeypatch.setattr(flash, "find_spec", lambda name: object())
    monkeypatch.setattr(flash, "command", lambda image, uri: [sys.executable, "-c", "raise SystemExit(3)"])
    with pytest.raises(AirTouchError, match="exit code 3") as error:
        flash.flash(flash.inspect(image(data)), URI)
    assert ("with the AI-deck's driver" in str(error.value)) == hint


def test_cfloader_itself_understands_the_targets(image, monkeypatch):
    """The installed cfloader parses our command line down to the targets that it would flash."""
    cfloader = pytest.importorskip("cfloader")
    links = []

    class Loader:
        def __init__(self, link):
            links.append(link)

        def flash_full(self, cf=None, filename=None, warm=None, targets=None, **_):
            links.extend((filename, [(t.platform, t.target, t.type) for t in targets]))

        def __getattr__(self, name):
            return lambda *_, **__: True

    monkeypatch.setattr(cfloader, "Bootloader", Loader)
    monkeypatch.setattr(cfloader.cflib.crtp, "init_drivers", lambda: None)
    for data, target in ((stm32(), ("cf2", "stm32", "fw")), (gap8(), ("deck", "bcAI:gap8", "fw"))):
        links.clear()
        path = image(data)
        monkeypatch.setattr(sys, "argv", flash.command(flash.inspect(path), URI)[2:])
        try:
            cfloader.main()
        except SystemExit as done:
            assert not done.code
        assert links == [URI, str(path), [target]]


def test_the_command_looks_and_does_not_flash(image):
    result = CliRunner().invoke(cli.command, [str(image(stm32())), "--check"])
    assert result.exit_code == 0 and "stm32, 40000 bytes, entry 0x08004100" in result.output
