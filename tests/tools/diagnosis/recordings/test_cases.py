"""Which flights `gap_real.py` diagnoses against which, on synthetic manifests."""

import pytest

from tools.diagnosis.recordings import cases as recorded_cases


@pytest.fixture
def folder(tmp_path):
    """Authors: eight calm flights of a day and condition, and some that are not; neural-swarm, CrazyPAD and peers."""
    calm = [f"a_b_0125-1200_{i}.csv,clean,none,{i % 3},0.5,0" for i in range(8)]
    others = ["a_b_0125-1200_8.csv,clean,fan,0,0.5,0", "a_b_0125-1200_9.csv,messy,none,0,0.5,0",
              *(f"a_b_0126-1200_{i}.csv,clean,none,1,0.5,0" for i in range(recorded_cases.OTHERS))]
    write(tmp_path / "airtouch", "manifest", "file,use,wind,fold,height,angle_deg", [*calm, *others])
    write(tmp_path / "neuralswarm", "manifest", "file,truth,vehicle,group,day",
          ["s19.csv,none,ns-34g,g19,19", "s20.csv,downwash,ns-34g,g20,20", "s21.csv,none,ns-67g,g21,21"])
    write(tmp_path / "neuralswarm", "baselines", "group,file",
          [*(f"g19,base19_{i}.csv" for i in range(3)), *(f"g20,base20_{i}.csv" for i in range(2)),
           *(f"g21,base21_{i}.csv" for i in range(7))])
    write(tmp_path / "crazypad", "manifest", "file,condition,drone",
          ["nA1.csv,normal_flight,A", "nA2.csv,normal_flight,A", "nB1.csv,normal_flight,B", "nB2.csv,normal_flight,B",
           *(f"c{i}.csv,cut_M1_{i}.0mm,A" for i in range(1, 6))])
    write(tmp_path / "peers", "manifest", "file,effect,vehicle", ["p1.csv,mass,A", "cal_A_0.csv.gz,none,A"])
    return tmp_path


def write(folder, name, header, rows):
    folder.mkdir(exist_ok=True)
    (folder / f"{name}.csv").write_text("\n".join([header, *rows]) + "\n")


def names(files):
    return [file.rsplit("/", 1)[1] for file in files]


@pytest.mark.parametrize("row", ["authors", "swarm", "crazypad", "peers", "nominal"])
def test_no_flight_is_its_own_baseline(folder, row):
    cases = list(recorded_cases.ROWS[row](folder, "all"))
    assert cases and all(c.baseline and c.flight not in c.baseline for c in cases)


@pytest.mark.parametrize("row", ["swarm", "crazypad", "peers"])
def test_every_flight_is_of_one_part(folder, row):
    build, view, both = ({c.flight for c in recorded_cases.ROWS[row](folder, part)}
                         for part in ("build", "view", "all"))
    assert build | view == both and not build & view and view


def test_four_of_the_authors_flights_are_held_against_five_calm_ones_of_their_day(folder):
    cases = list(recorded_cases.authors(folder, "build"))
    assert names(c.flight for c in cases) == [f"a_b_0125-1200_{i}.csv" for i in (0, 2, 4, 6)]
    assert all(len(c.baseline) == 5 and set(names(c.baseline)) <= {f"a_b_0125-1200_{i}.csv" for i in range(8)}
               for c in cases)
    assert {(c.unit, c.day) for c in cases} == {(c.unit, c.day) for c in recorded_cases.nominal(folder, "build")
                                                if c.flight in [x.flight for x in cases]}
    assert all(c.unit and c.day for c in cases)
    assert not list(recorded_cases.authors(folder, "view"))


def test_swarm_flights_have_the_baseline_of_their_group(folder):
    cases = {names([c.flight])[0]: c for c in recorded_cases.swarm(folder, "all")}
    assert names(cases["s20.csv"].baseline) == ["base20_0.csv", "base20_1.csv"] and cases["s20.csv"].truth == "downwash"
    assert names(c.flight for c in recorded_cases.swarm(folder, "view")) == ["s21.csv"]


def test_each_nominal_flight_of_three_or_more_is_held_against_five_others_of_its_group(folder):
    cases = list(recorded_cases.nominal(folder, "all"))
    groups = [names([c.flight])[0].rsplit("_", 1)[0] for c in cases]
    assert {g: groups.count(g) for g in groups} == {"a_b_0125-1200": 8, "a_b_0126-1200": 5, "base19": 3, "base21": 7}
    assert [len(c.baseline) for c, g in zip(cases, groups, strict=True) if g == "base21"] == [5] * 7
    assert all(name.startswith(g) for c, g in zip(cases, groups, strict=True) for name in names(c.baseline))


def test_crazypad_is_held_against_the_other_normal_flights_of_its_drone(folder):
    baselines = {names([c.flight])[0]: names(c.baseline) for c in recorded_cases.crazypad(folder, "all")}
    assert baselines["nA1.csv"] == ["nA2.csv"] and baselines["c1.csv"] == ["nA1.csv", "nA2.csv"]
    assert names(c.flight for c in recorded_cases.crazypad(folder, "view")) == ["c4.csv"]


def test_a_baseline_of_another_day_is_the_next_of_the_same_drone():
    def case(flight, drone, day, baseline):
        return recorded_cases.Case("swarm", "none", "v", flight, baseline, unit=(drone,), day=day)

    cases = [case("a1", "a", "19", ("a2", "a3")), case("a4", "a", "20", ("a6", "a5")), case("a7", "a", "21", ("a8",)),
             case("b1", "b", "19", ("b2",)), recorded_cases.Case("fan", "none", "v", "c1", ("c2",))]
    other = {c.flight: c.baseline for c in recorded_cases.of_another_day(cases)}
    assert other == {"a1": ("a5", "a6"), "a4": ("a8",), "a7": ("a2", "a3")}, "b and c were flown on one day"
