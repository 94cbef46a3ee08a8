"""The API page has every public function, as the code has it."""

import airtouch as at
from tools.pages import api_page


def test_the_page_is_what_the_docstrings_say():
    assert api_page.PAGE.read_text("utf-8") == api_page.page(), "python tools/pages/api_page.py"


def test_every_public_function_is_on_it():
    other = {"AirTouchError", "FlightLog", "__version__", "gap", "logs"}
    names = {f"at.{name}" for name in set(at.__all__) - other} | {f"at.gap.{name}" for name in at.gap.__all__}
    assert set(api_page.functions()) == names


def test_a_signature_is_written_as_in_the_code():
    def flown(log: "at.FlightLog | None", *, rate_hz: float = 100.0, name: str = "x") -> dict[str, float]:
        return {}

    assert api_page.signature("flown", flown) == (
        "flown(log: FlightLog | None, *, rate_hz: float = 100.0, name: str = 'x') -> dict[str, float]")
