"""The counts of `gap_peers.py`, on synthetic results."""

import sys
from dataclasses import replace

import pytest
from scipy.stats import binomtest

from airtouch.errors import AirTouchError
from airtouch.gap.result import NamedEffect, Quantity
from airtouch.gap.signatures.signature import SIGNATURES
from tools.diagnosis import gap_peers
from tools.diagnosis.recordings import peers


def test_flights_of_a_vehicle_are_held_against_its_own_two(tmp_path):
    lines = ("file,vehicle,effect", "cal_A_0.csv.gz,A,none", "p1.csv,A,latency", "p2.csv,B,mass")
    (tmp_path / "manifest.csv").write_text("\n".join(lines))
    rows = peers.labelled(tmp_path)
    assert [(r["file"], peers.truth(r)) for r in rows] == [("p1.csv", "sensor_latency"), ("p2.csv", "mass")]
    assert peers.vehicle_file(tmp_path, rows[1]) == tmp_path / "vehicle_b.toml"
    assert [path.name for path in peers.baseline(tmp_path, rows[1])] == ["cal_B_0.csv.gz", "cal_B_1.csv.gz"]


def result(ranked, shrink=None, control=None):
    """The result of a flight with more mass. ranked: the likeliest effects."""
    return gap_peers.PeerResult("a.csv", "mass", "0.1 kg", "effect", "", ranked, shrink, control, 1.0)


def test_names_of_one_thing_are_the_same_answer():
    """A heavier vehicle and less thrust are one thing in these logs; a weak rotor is another."""
    second = result(["weak_motor", "thrust_coefficient"])
    assert not second.within(1) and second.within(2)
    assert result(["thrust_coefficient"]).within(1)


def share(hits, n):
    ends = binomtest(hits, n).proportion_ci(method="wilson")
    return f"{hits} of {n} [{ends.low:.0%}, {ends.high:.0%}]"


def test_the_gap_closed_counts_where_the_first_answer_is_right():
    results = [result(["mass"], 0.9, 0.05), result(["mass"], 0.7), result(["mass"], 0.95, 0.1),
               result(["gust", "mass"], 0.1, 0.9), result(["mass"])]
    first, last = gap_peers.summary(results).splitlines()
    assert first == f"first answer {share(4, 5)}; first three {share(5, 5)} (95 % intervals)"
    assert last == "gap closed with the right effect: median 0.90, >= 0.80 in 2 of 3; with a wrong one at most 0.10"
    assert "median 0.80," in gap_peers.summary([result(["mass"], 0.9), result(["mass"], 0.7)])
    assert len(gap_peers.summary(results[3:]).splitlines()) == 1


def test_strengths_are_parameters_in_the_registry_s_units():
    def row(effect, strength, detail="{}"):
        return {"effect": effect, "strength": strength, "detail": detail}

    assert peers.true_parameters(row("act_delay", "8.3")) == pytest.approx({"delay": 0.0083})
    com = '{"com_m": [0.001, -0.002, 0.0]}'
    assert peers.true_parameters(row("com_offset", "1.2", com)) == {"x": 0.001, "y": -0.002}
    bias = peers.true_parameters(row("imu_bias", "1", '{"acc_bias": [1, 2, 3], "gyro_bias": [4, 5, 6]}'))
    assert bias == {"acc_x": 1, "acc_y": 2, "acc_z": 3, "gyro_x": 4, "gyro_y": 5, "gyro_z": 6}
    assert peers.true_parameters(row("wind", "0.5", '{"wind_mps": [0.5, 0.0, 0.0]}')) == {}
    assert peers.true_parameters({"effect": "mass", "strength": "0.1"}) == {"fraction": 0.1}
    weak = peers.true_parameters(row("weak_motor", "0.1", '{"motor": "m2"}'))
    assert weak == {"thrust_loss": 0.1, "rotor": 2.0}
    named = [NamedEffect("weak_motor", {"rotor": Quantity(n), "thrust_loss": Quantity(0.1)}) for n in (2.0, 3.0)]
    assert [gap_peers.is_same_rotor(effect, weak) for effect in named] == [True, False]
    assert gap_peers.is_same_rotor(named[1], {"thrust_loss": 0.1}), "where the manifest has no rotor"
    for name, (parameter, _) in peers.STRENGTHS.items():
        assert parameter in SIGNATURES[name].free


def test_parameters_of_right_answers_are_scored():
    """Errors of 10, 50 and 0 %; the last is a wrong name, which does not count."""
    def known(value, low, high):
        return {"drawn": {"fraction": 0.2}, "known": {"fraction": {"value": value, "low": low, "high": high}}}

    results = [replace(result(["mass"]), **known(0.22, 0.19, 0.25)), replace(result(["mass"]), **known(0.1, 0.0, 0.19)),
               replace(result(["gust"]), **known(0.2, 0.1, 0.3)), result(["mass"])]
    line = gap_peers.summary(results).splitlines()[1]
    assert line.startswith("parameters: median error 30.0% [10.0%, 50.0%] in 2 flights; in their 90 % interval 1 of 2")


def test_a_run_goes_on_where_the_last_one_stopped(tmp_path, monkeypatch, capsys):
    (tmp_path / "manifest.csv").write_text("file,vehicle,effect\na.csv,A,mass\nb.csv,A,mass\nc.csv,A,mass\n")
    diagnosed = []

    def diagnose_flight(_, label):
        if len(diagnosed) == 1 and label["file"] == "b.csv":
            diagnosed.append("stopped")
            raise AirTouchError("b.csv: too short")
        diagnosed.append(label["file"])
        return replace(result(["mass"], 0.9), file=label["file"])

    monkeypatch.setattr(gap_peers, "diagnose_flight", diagnose_flight)
    monkeypatch.setattr(sys, "argv", ["gap_peers.py", str(tmp_path), "--keep", str(tmp_path / "results.jsonl")])
    with pytest.raises(AirTouchError, match="too short"):
        gap_peers.main()
    gap_peers.main()
    assert diagnosed == ["a.csv", "stopped", "b.csv", "c.csv"]
    lines = capsys.readouterr().out.splitlines()
    assert lines.count("| mass | 0.1 kg | effect |  | 0.90 |  | 1 |") == 3
    assert f"first answer {share(3, 3)}; " in lines[-2]
