"""Blocks flattened: made once for a hypothesis judged many times."""

from airtouch.gap.evidence import problem
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.problem import Problem, problem_of, whole_of
from airtouch.gap.nominal.build_study import declared_study
from airtouch.gap.signals.channels import TORQUE
from airtouch.gap.signals.response import FIRST_BIN
from airtouch.gap.signals.spectra import AIR
from gap_flights import VEHICLE, flight


def test_without_a_response_torque_counts_in_the_means_alone():
    """Whoever makes the data: the arm of the declared vehicle, the seconds of a known wake."""
    assert problem_of(data := Data(declared_study(VEHICLE, ()), [flight(20.0)]), whole_of(data)).layout.keep[AIR][
        FIRST_BIN:, TORQUE].sum() == 0
    assert data.means_only and problem_of(data, whole_of(data)).layout.keep[AIR][:FIRST_BIN, TORQUE].all()


def test_all_blocks_of_some_flights_are_flattened_once(monkeypatch):
    """A long-lived set of flights, judged a thousand times, else kept a thousand copies of them."""
    problems = []
    monkeypatch.setattr(problem, "Problem", lambda data, part: problems.append(part) or Problem(data, part))
    data = Data(declared_study(VEHICLE, ()), [flight(20.0), flight(20.0, name="other")])
    blocks = whole_of(data)
    assert {i for i, _, _ in blocks.pieces} == {0, 1} and all(chosen.all() for _, _, chosen in blocks.pieces)
    assert problem_of(data, whole_of(data)) is problem_of(data, blocks)
    assert {i for i, _, _ in whole_of(data, [1]).pieces} == {1}
    assert [p.key for p in problems] == [blocks.key]
