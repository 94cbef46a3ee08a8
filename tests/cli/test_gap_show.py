"""What `airtouch gap` prints of a diagnosis."""

import made_diagnosis
from airtouch.cli.gap import show
from airtouch.cli.shared import scores
from airtouch.gap.answer.sentences import sentences


def test_terminal_prints_sentences_notes_and_advice(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "400")
    result = made_diagnosis.of_flights(made_diagnosis.fly_pushed())
    show.diagnosis(scores.console(), result)
    out = " ".join(capsys.readouterr().out.split())
    for part in (*sentences(result), "another fits better", "Weigh the <vehicle>.",
                 "airtouch collect --mission hover"):
        assert part in out, part
