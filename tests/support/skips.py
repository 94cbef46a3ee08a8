"""Where the recorded flights are, a test may skip for want of a tool only: any other skip is a failure.

A skip for want of data hides that a check no longer runs: a folder renamed, a file left out of a copy.
A new reason that names a tool or a package goes into TOOLS.
"""

import os
import re
from importlib.util import find_spec
from pathlib import Path

import pytest

#: reasons that name a compiler, a package or a checkout that a machine need not have
TOOLS = re.compile(r"could not import|pip install|needs the extra|needs cflib|on this machine|sanitizer|"
                   r"no C compiler|no cross compiler|no arm-none-eabi-gcc|set CRAZYFLIE_BASE|no CMSIS-DSP")


def folder() -> Path:
    """Where recorded flights are looked for."""
    return Path(os.environ.get("AIRTOUCH_FLIGHTS", Path(__file__).parents[3] / "shared" / "flights"))


def needs(package: str) -> pytest.MarkDecorator:
    """Skips where a package is missing; unlike importorskip it is not imported while the tests are collected."""
    return pytest.mark.skipif(find_spec(package) is None, reason=f"could not import {package!r}")


def _guard(report: pytest.TestReport | pytest.CollectReport) -> None:
    """A skip becomes a failure unless a tool is missing, or there are no flights at all."""
    if not report.skipped or hasattr(report, "wasxfail") or not isinstance(report.longrepr, tuple):
        return
    path, line, reason = report.longrepr
    folders = [place for place in (folder(), Path(__file__).parents[3] / "shared" / "flights") if place.is_dir()]
    if folders and not TOOLS.search(reason):
        report.outcome = "failed"
        report.longrepr = f"{path}:{line}: recorded flights are in {folders[0]}, and yet: {reason}"


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport():
    """A test's own skip."""
    _guard((yield).get_result())


@pytest.hookimpl(hookwrapper=True)
def pytest_make_collect_report():
    """The skip of a whole file."""
    _guard((yield).get_result())
