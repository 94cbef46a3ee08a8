"""When an error counts as reached."""

from airtouch.paper_figures import words


def row(error, low, missed):
    return {"mean_abs_error_m": error, "missed": missed, "intervals": {"mean_abs_error_m": low and (low, 9.0)}}


def test_an_error_is_reached_within_its_interval_and_with_few_misses_alone():
    assert words.reaches(row(0.04, 0.029, 0.05), 0.03)
    assert not words.reaches(row(0.04, 0.031, 0.05), 0.03)
    assert not words.reaches(row(0.01, 0.005, 0.66), 0.03)
    assert not words.reaches(row(None, None, 1.0), 0.03)
    assert words.reaches(row(0.02, None, 0.0), 0.03)


def test_an_unknown_number_of_false_edges_is_no_zero():
    known = {**row(0.02, 0.01, 0.0), "edges": 4}
    known["intervals"]["missed"] = None
    assert words.score({**known, "false_per_minute": 0.0}).endswith(", 0.0 false a minute")
    assert words.score({**known, "false_per_minute": None}).endswith(", - false a minute")
