"""The groups of nominal flights, on synthetic manifests."""

import pytest

from airtouch import logs
from made_flight import made_flight
from tools.calibration.nominal import groups


def test_the_authors_groups_are_flights_of_one_day_height_and_angle_in_still_air(tmp_path):
    rows = [f"a_b_0125-1200_{i}.csv,clean,none,{i},0.5,0" for i in range(5)]
    rows += ["a_b_0126-1200_5.csv,clean,none,0,0.5,0", "a_b_0125-1200_6.csv,clean,fan,0,0.5,0",
             "a_b_0125-1200_7.csv,clean,none,0,0.5,30"]
    (tmp_path / "manifest.csv").write_text("file,use,wind,fold,height,angle_deg\n" + "\n".join(rows) + "\n")
    assert {g.name: "".join(name[-5] for name, _ in g.logs) for g in groups.authors(tmp_path)} == {
        "0125 0.5 0": "012", "0126 0.5 0": "5", "0125 0.5 30": "7"}  # folds 3 and 4 are not for building


@pytest.fixture
def swarm(tmp_path):
    (tmp_path / "baselines.csv").write_text("file,day,cf,group,vehicle\nb1.csv.gz,19,cf50,g19,ns-34g\n"
                                            "b2.csv.gz,20,cf50,g20,ns-34g\nb3.csv.gz,21,cf50,g21,ns-34g\n")
    (tmp_path / "manifest.csv").write_text(
        "file,day,cf,group,vehicle,truth\nm1.csv.gz,19,cf50,g19,ns-34g,none\nm2.csv.gz,19,cf50,g19,ns-34g,downwash\n"
        "m3.csv.gz,19,cf51,g19,ns-34g,none\nm4.csv.gz,21,cf50,g21,ns-34g,none\n")
    (tmp_path / "flights").mkdir()
    return tmp_path


def test_neural_swarms_groups_are_nominal_flights_of_one_vehicle_and_day_for_building(swarm, monkeypatch):
    monkeypatch.setattr(groups.vehicles, "load", lambda path: path.stem)
    found = {(g.drone, g.name): [name for name, _ in g.logs] for g in groups.swarm(swarm)}
    assert found == {("cf50", "g19"): ["b1.csv.gz", "m1.csv.gz"], ("cf50", "g20"): ["b2.csv.gz"],
                     ("cf51", "g19"): ["m3.csv.gz"]}


def test_a_flight_is_read_when_it_is_called_for(swarm, monkeypatch):
    monkeypatch.setattr(groups.vehicles, "load", lambda path: path.stem)
    flight = made_flight(n=300)
    logs.write(flight, swarm / "flights/b1.csv.gz")
    _, load = next(iter(groups.swarm(swarm))).logs[0]
    assert len(load()) == len(flight)
