"""What `airtouch gap` prints of a diagnosis."""

import made_diagnosis
from airtouch.cli.gap import show
from airtouch.cli.shared import output
from airtouch.gap.answer.sentences import sentences


def test_terminal_prints_sentences_notes_and_advice(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "400")
    result = made_diagnosis.of_flights(made_diagnosis.fly_pushed())
    show.diagnosis(output.console(), result)
    out = " ".join(capsys.readouterr().out.split())
    for part in (*sentences(result), "another fits better", "Weigh the <vehicle>.",
                 "airtouch collect --mission hover"):
        assert part in out, part


def test_a_shrink_that_was_not_measured_is_no_nought(capsys, monkeypatch):
    """Of a mass it was measured, of `none` and `unknown` it was not."""
    monkeypatch.setenv("COLUMNS", "400")
    show.diagnosis(output.console(), made_diagnosis.diagnosis())
    rows = [line.replace("│", " ").split() for line in capsys.readouterr().out.splitlines()]
    assert {r[0]: r[2] for r in rows if r[:1] and r[0] in ("mass", "none", "unknown")} \
        == {"mass": "0.00", "none": "-", "unknown": "-"}


def test_the_cell_of_the_answer_is_told_from_those_that_clear_the_floor(capsys, monkeypatch):
    """It is the first, and lies inside its floor where no other is shrunk by the effect."""
    monkeypatch.setenv("COLUMNS", "400")
    inside, over = (made_diagnosis.cell(c, "hover", gap, after=after)
                    for c, gap, after in (("force_z", 0.11, 0.05), ("force_x", 0.9, 0.9)))
    for cells, says in (([inside, over], True), ([over], False)):
        show.diagnosis(output.console(), made_diagnosis.diagnosis(cells))
        out = " ".join(capsys.readouterr().out.split())
        assert ("the first, which does not, is that of the answer" in out) is says
