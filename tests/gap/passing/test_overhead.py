"""A wake in seconds that another vehicle's log tells."""

from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner

import airtouch.gap.diagnosis as module
from airtouch.cli import airtouch
from airtouch.errors import AirTouchError
from airtouch.gap.diagnosis import diagnose
from airtouch.gap.evidence.data import Data
from airtouch.gap.flights.clock import at_100_hz, with_lost_rows
from airtouch.gap.flights.flight import GROUND, PERIOD_S, ready
from airtouch.gap.naming.policy import PASSING_GAIN
from airtouch.gap.nominal.build_study import declared_study
from airtouch.gap.passing import gates, overhead
from airtouch.gap.signatures.scatter import size_of
from airtouch.gap.signatures.signature import OVERHEAD
from airtouch.logs.flight_log import FlightLog
from gap_flights import LOOP, VEHICLE, fly
from tools import gap_real
from tools.diagnosis.recordings import cases as recorded_cases

SECONDS = ((7.0, 7.4), (9.2, 9.7), (13.0, 13.3))


def path(begin_s, place, seconds=20.0):
    """The log of a vehicle that hangs at a place."""
    time = begin_s + np.arange(0.0, seconds, 0.01)
    return FlightLog({"t_s": time, **{k: np.full(len(time), v) for k, v in zip(overhead.POSITION, place, strict=True)}},
                     {"source": "one"})


def test_a_vehicle_is_overhead_where_both_logs_hold_the_time():
    low = path(3.0, (0.0, 0.0, 0.5))
    assert overhead.seconds_overhead(low, [path(8.0, (0.1, 0.0, 0.9), 4.0)]) == (pytest.approx((5.0, 9.0), abs=0.02),)
    for place in ((0.2, 0.0, 0.9), (0.0, 0.0, 0.55), (0.0, 0.0, 1.2), (0.0, 0.0, 0.1)):
        assert overhead.seconds_overhead(low, [path(3.0, place)]) == ()


def test_a_partner_is_overhead_though_the_first_time_of_a_fast_log_is_missing():
    """The log is resampled, from its first known time on: 8 to 12 s on the clock are 5 to 9 s after it."""
    time = 3.0 + 0.002 * np.arange(10_000)
    time[0] = np.nan
    low = FlightLog({"t_s": time, **{k: np.full(len(time), v) for k, v in zip(overhead.POSITION, (0.0, 0.0, 0.5),
                                                                             strict=True)}}, {"source": "low"})
    assert overhead.seconds_overhead(low, [path(8.0, (0.1, 0.0, 0.9), 4.0)]) == (pytest.approx((5.0, 9.0), abs=0.02),)


def test_two_vehicles_overhead_one_after_another_are_two_intervals():
    low = path(0.0, (0.0, 0.0, 0.5))
    partners = [path(2.0, (0.0, 0.0, 0.9), 1.0), path(6.0, (0.0, 0.1, 0.8), 2.0)]
    assert np.array(overhead.seconds_overhead(low, partners)).ravel() == pytest.approx([2.0, 3.0, 6.0, 8.0], abs=0.02)


@pytest.mark.parametrize(("period_s", "lost"), [(0.0101, 0), (0.0099, 0), (0.01, 200), (0.005, 0)])
def test_the_seconds_overhead_are_those_of_the_ready_flights_rows(period_s, lost):
    """Where a made log holds a mark for each row that is overhead, its ready flight holds it in the same seconds."""
    time = 3.0 + period_s * np.arange(round(70.0 / period_s))
    flown = np.delete(np.arange(len(time)), np.arange(1000, 1000 + lost))
    mark = (time >= 58.0) & (time < 59.0)
    low = FlightLog({"t_s": time[flown], "vbat_V": mark[flown].astype(float),
                     **{k: np.full(len(flown), v) for k, v in zip(overhead.POSITION, (0.0, 0.0, 0.5), strict=True)}})
    ready, _, _ = with_lost_rows(at_100_hz(low, "low"), "low")
    (begin, end), = overhead.seconds_overhead(low, [path(58.0, (0.0, 0.1, 0.9), 1.0)])
    marked = np.flatnonzero(ready["vbat_V"] > 0.5) * PERIOD_S
    assert (begin, end) == pytest.approx((marked[0], marked[-1]), abs=0.03)


@pytest.mark.parametrize(("rate_hz", "gone_s", "passes"), [
    (100.0, 0.0, 1), (100.0, 0.06, 1), (100.0, 2.0, 0), (10.0, 0.0, 1), (10.0, 2.0, 0)])
def test_nobody_is_overhead_in_a_hole_of_the_partners_log(rate_hz, gone_s, passes):
    """A partner that flies over at 0.5 m/s while its rows are lost may have flown round, or waited."""
    time = np.arange(0.0, 20.0, 1.0 / rate_hz)
    time = time[np.abs(time - 10.0) >= 0.5 * gone_s]
    partner = FlightLog({"t_s": time, "x_m": 0.5 * (time - 10.0), "y_m": 0.0 * time, "z_m": 0.9 + 0.0 * time})
    assert len(overhead.seconds_overhead(path(0.0, (0.0, 0.0, 0.5)), [partner])) == passes
    partner = partner.with_columns({"z_m": np.where(np.abs(time - 10.0) < 1.0, np.nan, 0.9)})
    assert overhead.seconds_overhead(path(0.0, (0.0, 0.0, 0.5)), [partner]) == ()


def test_a_partner_without_a_path_is_refused():
    blind = FlightLog({"t_s": np.arange(10.0)}, {"source": "blind.csv"})
    with pytest.raises(AirTouchError, match="x_m"):
        overhead.seconds_overhead(path(0.0, (0.0, 0.0, 0.5)), [blind])


def test_a_partner_whose_clock_goes_back_is_refused():
    """Two recordings in one file, 5 m away in the first, overhead in the second."""
    time = np.tile(np.arange(0.0, 10.0, 0.01), 2)
    twice = FlightLog({"t_s": time, "x_m": np.repeat([5.0, 0.0], 1000), "y_m": 0.0 * time, "z_m": 0.9 + 0.0 * time},
                      {"source": "twice.csv"})
    with pytest.raises(AirTouchError, match="twice.csv: its clock t_s goes back after 9.99 s"):
        overhead.seconds_overhead(path(0.0, (0.0, 0.0, 0.5)), [twice])


@pytest.fixture(scope="module")
def nominal_flight():
    return fly(1, 62)[0]


def evidence(study, one):
    """Size of a wake in SECONDS beyond its limit, and its gain."""
    known = overhead.with_overhead(study, one, SECONDS)
    wake = gates.passing_effects(Data(known, [one]))[gates.KNOWN_OVERHEAD]
    size = size_of(wake.gain / ((one.phase != GROUND).sum() * PERIOD_S), wake.strength)
    return known.scatter.unusual({wake.key: size}), wake.gain


def rested(flight, rows):
    """A flight whose log begins with so many more rows on the ground, drawn from those before its take-off."""
    rest = np.random.default_rng(0).choice(np.flatnonzero(~flight.on_ground)[0], rows)
    columns = {k: np.concatenate([v[rest], v]) for k, v in flight.log.columns.items()}
    columns["t_s"] = np.arange(rows + len(flight)) * PERIOD_S
    return ready(FlightLog(columns, flight.log.meta), VEHICLE)


def test_rest_before_a_flight_says_nothing_of_a_wake(study, nominal_flight):
    """A flight that is shaken all along in the air, with and without half a minute on the ground before."""
    shake = 2.0 * np.random.default_rng(0).normal(size=len(nominal_flight)) * ~nominal_flight.on_ground

    def size(flight):
        force, later_s = flight.acceleration.copy(), (len(flight) - len(shake)) * PERIOD_S
        force[len(flight) - len(shake):, 2] += shake
        seconds = tuple((a + later_s, b + later_s) for a, b in SECONDS)
        known = overhead.with_overhead(study, replace(flight, acceleration=force), seconds)
        return known.scatter.passing[gates.KNOWN_OVERHEAD][0]

    assert size(rested(nominal_flight, 3000)) == pytest.approx(size(nominal_flight), rel=0.05)


def test_known_seconds_are_shifted_around_the_time_in_the_air():
    """Ten seconds of which two in the middle are on the ground: an interval is shifted by whole seconds, around."""
    phase = np.where((np.arange(1000) >= 400) & (np.arange(1000) < 600), GROUND, GROUND + 1)
    flight = SimpleNamespace(name="a", phase=phase)
    shifted = overhead._shifted_gates(flight, ((1.5, 2.5),))
    assert [[(round(a, 6), round(b, 6)) for _, a, b in gate] for gate in shifted] == [
        [(2.5, 3.5)], [(3.5, 4.0), (6.0, 6.5)], [(6.5, 7.5)], [(7.5, 8.5)], [(8.5, 9.5)], [(9.5, 10.0)], [(0.5, 1.5)]]


def test_a_short_push_in_told_seconds_is_beyond_nominal_and_none_is_not(study, nominal_flight):
    t = np.arange(len(nominal_flight)) * PERIOD_S
    acts = np.any([(t >= a) & (t < b) for a, b in SECONDS], axis=0)
    force = nominal_flight.acceleration.copy()
    force[acts, 2] -= 0.06 * VEHICLE.gravity_mps2
    over, gain = evidence(study, replace(nominal_flight, acceleration=force))
    assert over > 0.0 and gain > PASSING_GAIN
    over, gain = evidence(study, nominal_flight)
    assert over < 0.0 or gain < PASSING_GAIN


def test_a_flight_that_shakes_all_along_has_no_wake_in_told_seconds(study, nominal_flight):
    force = nominal_flight.acceleration.copy()
    force[:, 2] += 0.03 * VEHICLE.gravity_mps2 * np.random.default_rng(3).normal(size=len(nominal_flight))
    over, _ = evidence(study, replace(nominal_flight, acceleration=force))
    assert over < 0.0


def test_the_rest_of_a_flight_is_apart_from_the_told_seconds(study, nominal_flight):
    """A shake in the known seconds and a fifth of a second around them is none of the rest's, one elsewhere is."""
    t = np.arange(len(nominal_flight)) * PERIOD_S
    shake = np.random.default_rng(3).normal(size=len(t))

    def size(acts):
        force = nominal_flight.acceleration + np.where(acts, shake, 0.0)[:, None] * [0.0, 0.0, 1.0]
        flight = replace(nominal_flight, acceleration=force)
        return overhead.with_overhead(study, flight, ((8.0, 18.0),)).scatter.passing[gates.KNOWN_OVERHEAD][0]

    near_overhead = (t >= 7.8) & (t < 18.2)
    assert size(near_overhead) == size(np.zeros(len(t), bool)) < size(~near_overhead) - 0.02


def test_sizes_scatter_as_those_that_are_looked_for(study, nominal_flight):
    looked_for = study.scatter.passing[OVERHEAD]
    known = overhead.with_overhead(study, nominal_flight, SECONDS).scatter.passing[gates.KNOWN_OVERHEAD]
    assert known[1] == looked_for[1]
    nearly_all = ((0.0, 0.9 * len(nominal_flight) * PERIOD_S),)  # so that the rest is too short to be a yardstick
    assert overhead.with_overhead(study, nominal_flight, nearly_all).scatter.passing[gates.KNOWN_OVERHEAD] == looked_for


def test_no_seconds_change_nothing(study, nominal_flight):
    assert overhead.with_overhead(study, nominal_flight, ()) is study


def test_a_partner_belongs_to_one_flight(tmp_path):
    with pytest.raises(AirTouchError, match="one flight"):
        diagnose([f.log for f in fly(2, 62)], VEHICLE, partner=[path(0.0, (0.0, 0.0, 0.5))])
    result = CliRunner().invoke(airtouch, ["gap", "diagnose", "x.csv", "--each", "--partner", "y.csv"])
    assert result.exit_code != 0 and "one flight" in str(result.exception or result.output)


def test_where_no_wake_is_judged_a_note_says_that_the_partner_was_not_used(monkeypatch, nominal_flight):
    """As in flights without a gyro, whose balance is judged instead."""
    monkeypatch.setattr(module.balance_result, "applies", lambda *_: True)
    monkeypatch.setattr(module.balance_result, "diagnosis", lambda *arguments: arguments[3])
    log = nominal_flight.log.with_columns({k: np.zeros(len(nominal_flight)) for k in overhead.POSITION})
    assert module.diagnose([log], VEHICLE) == []
    assert module.diagnose([log], VEHICLE, partner=[log]) == [overhead.UNUSED.format("a gyro")]


def test_the_note_has_the_seconds_overhead_or_says_what_lacks(study):
    assert overhead.note(study, [(1.0, 2.0), (5.0, 5.5)]) == "the other vehicle was overhead for 1.5 s"
    assert overhead.note(study, ()) == "the other vehicle was never overhead"
    assert "without baseline flights no wake" in overhead.note(declared_study(VEHICLE, ()), [(1.0, 2.0)])


def test_a_short_wake_of_a_recorded_flight_is_named_with_its_seconds(flights, monkeypatch):
    monkeypatch.setattr(gap_real, "diagnose", partial(diagnose, without=LOOP))
    cases = [c for c in recorded_cases.swarm(flights, "build") if c.flight.endswith("downwash_cf102d19_008.csv.gz")]
    case, = recorded_cases.with_partners(cases, flights)
    assert case.partner
    diagnosis = gap_real.diagnose_case(case)
    assert gap_real.answer(diagnosis) == "downwash"
    assert any(abs(s["from_s"] - 5.5) < 0.3 for s in diagnosis["effects"][0]["seconds"])
