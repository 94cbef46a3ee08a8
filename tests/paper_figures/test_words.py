"""When an error counts as reached."""

import re
from pathlib import Path

import numpy as np
import pytest

from airtouch.detector.evaluation.data.dataset import Condition
from airtouch.detector.evaluation.score import score_flight
from airtouch.detector.evaluation.summary import summarise
from airtouch.detector.trace import Trace
from airtouch.paper_figures import words
from airtouch.paper_figures.claims import CLAIMS
from airtouch.paper_figures.figures import components, sizes, table1, vision

PAGE = Path(__file__).resolve().parents[2] / "host" / "docs" / "paper.md"
RULES = PAGE.read_text().split("## How a claim is judged")[1].split("\n## ")[0]


def row(error, low, missed, high=9.0, edges=20):
    return {"edges": edges, "mean_abs_error_m": error, "missed": missed,
            "intervals": {"mean_abs_error_m": low and (low, high), "missed": (missed, missed)}}


def test_an_error_is_reached_by_a_narrow_interval_and_with_few_misses_alone():
    assert words.reaches(row(0.03, 0.029, 0.05, 0.033), 0.03) is True
    assert words.reaches(row(0.04, 0.029, 0.05), 0.03) is None  # the interval ends at 9 m: anything may be true
    assert words.reaches(row(0.04, 0.031, 0.05), 0.03) is False
    assert words.reaches(row(0.01, 0.005, 0.66, 0.02), 0.03) is False
    assert words.reaches(row(None, None, 1.0), 0.03) is False
    assert words.reaches(row(0.02, None, 0.0), 0.03) is None  # of one flight


def test_flights_without_an_edge_decide_nothing():
    scores = [score_flight("f.csv", Condition(), [], np.ones(500, dtype=bool), Trace(np.zeros(500), []), 0.0)]
    assert words.reaches(summarise(scores), 0.03) is None


def test_two_wide_intervals_are_not_the_same():
    first = row(0.03, 0.029, 0.0, 0.031)
    assert words.worse(first, row(0.05, 0.045, 0.0, 0.055)) is True
    assert words.worse(first, row(0.03, 0.029, 0.5, 0.031)) is True
    assert words.worse(first, row(0.03, 0.028, 0.0, 0.032)) is False
    assert words.worse(first, row(0.03, 0.001, 0.0, 0.09)) is None
    assert words.worse(first, row(0.03, None, 0.0)) is None


def test_an_unknown_number_of_false_edges_is_no_zero():
    known = {**row(0.02, 0.01, 0.0), "edges": 4}
    known["intervals"]["missed"] = None
    assert words.score({**known, "false_per_minute": 0.0}).endswith(", 0.0 false a minute")
    assert words.score({**known, "false_per_minute": None}).endswith(", - false a minute")


def rules():
    """Claim -> the cells of its row in the page's table of rules."""
    rows = [line.strip("|").split("|") for line in RULES.splitlines() if line.startswith("| `")]
    named = [(claim, cells) for cells in rows for claim in re.findall("`([^`]+)`", cells[0])]
    assert len(named) == len({claim for claim, _ in named})
    return dict(named)


def test_the_page_has_a_rule_of_every_claim_under_its_figure():
    assert set(rules()) == set(CLAIMS)
    for claim, (_, figures, _) in rules().items():
        assert f"`{CLAIMS[claim].figure}`" in figures


@pytest.mark.parametrize("claim, number", [
    ("baseline", f"{words.SHARE_MARGIN:.2f} below the paper's {CLAIMS['baseline'].values[2]:g};"),
    ("height-4cm", f"{words.SHARE_MARGIN:.2f} below the paper's {CLAIMS['height-4cm'].values[0]:.2f};"),
    ("height-9cm", f"at {CLAIMS['height-9cm'].values[0]:.2f} or below"),
    ("df-loss", f"gain ({100 * components.HALF * CLAIMS['df-loss'].values[2]:g} %)"),
    ("df-epochs", f"gain ({100 * components.HALF * CLAIMS['df-epochs'].values[2]:g} %)"),
    ("input-size", f"in {100 * components.SURE:g} % of the"),
    ("accuracy", f"above {sizes.LEAST_ACCURACY}, and that of the loss to int8 with zeros above {sizes.LEAST_LOSS}"),
    ("power", f"within {100 * words.ERROR_MARGIN:g} % of"), ("negligible", f"below {100 * table1.NEGLIGIBLE:g} % of"),
    ("backup", f"at {vision.F1_MARGIN} of timed F1")])
def test_a_rule_on_the_page_has_the_number_of_the_code(claim, number):
    assert number in rules()[claim][2]


def test_the_margins_on_the_page_are_those_of_the_code():
    text = " ".join(RULES.split())
    error, share = f"{100 * words.ERROR_MARGIN:g} %", f"{100 * words.SHARE_MARGIN:g} %"
    assert f"most {error} above the paper's" in text and f"than {100 * words.MOST_MISSED:g} % of the edges are" in text
    assert f"{error} of the first's error, and {share} of the edges" in text
    assert f"within {100 * words.COUNT_MARGIN:g} % of the paper's" in text
