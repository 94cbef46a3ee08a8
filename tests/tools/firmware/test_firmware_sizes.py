"""The table of what the app adds to the firmware, from what the firmware's makefile prints."""


import pytest

from tools.firmware import firmware_sizes

STOCK = """Build for the cf2 platform!
Flash |  307244/1032192 (30%),  724948 free | text: 298392, data: 8852, ccmdata: 0
RAM   |   93184/131072  (71%),   37888 free | bss: 84332, data: 8852
CCM   |   64888/65536   (99%),     648 free | ccmbss: 64888, ccmdata: 0
"""


def test_a_row_says_what_is_used_added_and_left():
    stock = firmware_sizes.parse(STOCK)
    with_app = firmware_sizes.parse(STOCK.replace(" 307244/", " 336404/").replace("  93184/", " 112528/"))
    assert firmware_sizes.row("plain", stock) == "| plain | 307.2 / 93.2 / 64.9 |  | 724.9 / 37.9 / 0.6 |  |"
    assert firmware_sizes.row("app", with_app, stock, 696) == \
        "| app | 336.4 / 112.5 / 64.9 | +29.2 / +19.3 / +0.0 | 695.8 / 18.5 / 0.6 | 696 |"


def test_a_build_without_sizes_ends_it():
    with pytest.raises(SystemExit, match="no sizes"):
        firmware_sizes.parse(STOCK.split("CCM")[0])


def test_a_build_with_a_warning_ends_it():
    with pytest.raises(SystemExit, match="warning: x"):
        firmware_sizes.build_output("sh", "-c", "echo 'a.c:1: warning: x' >&2")
