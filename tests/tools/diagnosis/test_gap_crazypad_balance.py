"""The table of the balance's test: a figure that cannot be computed is a dash with its reason."""

from types import SimpleNamespace

import numpy as np

from tools.diagnosis import gap_crazypad_balance
from tools.diagnosis.recordings.crazypad.balance import RotorTest


def test_severity_of_equal_cuts_is_a_dash_with_its_reason(capsys):
    tests = [RotorTest(("E8", f"cut_M{rotor}_2mm_2mm"), False, 1.0, np.array([True]), np.array([True]), np.array([2.0]))
             for rotor in (1, 2)]
    gap_crazypad_balance.show_rotor(tests)
    rows = [line for line in capsys.readouterr().out.splitlines() if line.startswith("| a")]
    assert len(rows) == 2 and all("- (all cuts are the same)" in row and "nan" not in row for row in rows)


def test_each_condition_has_a_line_with_its_changes_in_percent(capsys):
    pairs = [("E8", "cut_M1_2mm"), ("E9", "cut_M2_2mm")]
    means = np.array([[0.01, -0.02, 0.0, 0.034], [0.114, 0.0, 0.0, -0.051]])
    gap_crazypad_balance.show_conditions(SimpleNamespace(pairs=pairs, means=means))
    first, second = (line.split(maxsplit=2) for line in capsys.readouterr().out.splitlines() if line.startswith("  "))
    assert first == ["E8", "cut_M1_2mm", "1.0 %, -2.0 %, 0.0 %, 3.4 %"]
    assert second == ["E9", "cut_M2_2mm", "11.4 %, 0.0 %, 0.0 %, -5.1 %"]
