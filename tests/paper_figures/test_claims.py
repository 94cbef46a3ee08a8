"""What the page says of the paper against the paper's source."""

import re
from pathlib import Path

import pytest

from airtouch.paper_figures import run
from airtouch.paper_figures.claims import CLAIMS

SOURCE = Path(__file__).parents[3] / "shared" / "paper" / "airtouch.tex"


@pytest.mark.skipif(not SOURCE.exists(), reason="the paper's source is not on this machine")
@pytest.mark.parametrize("name", CLAIMS)
def test_each_quote_stands_in_its_line(name):
    claim = CLAIMS[name]
    assert claim.quote in SOURCE.read_text("utf-8").splitlines()[claim.line - 1]


@pytest.mark.parametrize("name", CLAIMS)
def test_each_number_stands_in_its_quote(name):
    claim = CLAIMS[name]
    numbers = [float(n.replace(",", "")) for n in re.findall(r"\d[\d,]*\.?\d*", claim.quote)]
    for value in claim.values:
        assert any(value == pytest.approx(n * scale) for n in numbers
                   for scale in (1, 0.01, 0.001, 1e3, 1e6, 60)), value


def test_every_claim_belongs_to_a_figure_and_every_figure_has_one():
    assert {claim.figure for claim in CLAIMS.values()} == set(run.FIGURES)
