"""Diagnoses made by hand, and maps of real measurements of simulated flights, for tests of what is said of them."""

from dataclasses import replace

import short_flights
from airtouch import vehicle
from airtouch.gap.answer.curves import curves_of
from airtouch.gap.flights.flight import ready
from airtouch.gap.nominal.build_study import declared_study
from airtouch.gap.result import Closure, Control, Diagnosis, NamedEffect, NextStep, Quantity, RankedCandidate
from airtouch.gap.signatures.candidates import term_of
from airtouch.gap.where import summary
from airtouch.gap.where.cell import BASELINE, Cell, GapMap
from airtouch.gap.where.gap_map import gap_map

VEHICLE = vehicle.load("crazyflie-2.1-flow")
FOUND = NamedEffect("imu_bias", {"acc_x": Quantity(0.8, 0.7, 0.9, "m/s^2")})


def fly_pushed():
    """Two short flights whose accelerometer reads 0.8 m/s^2 too much forward."""
    return [log.with_columns({"acc_x_mps2": log["acc_x_mps2"] + 0.8}) for log in short_flights.fly(2)]


def cell(channel, phase, gap, floor=0.1, after=None, blocks=10, **more):
    return Cell(channel, more.pop("band_hz", (0.0, 0.5)), phase, gap, floor, "m/s^2", 0.9 * gap, 1.1 * gap,
                blocks=blocks, flights=1, after=after, floor_high=1.2 * floor, **more)


def diagnosis(cells=(), verdict="effect", effects=(FOUND,), headline=None, **more):
    rejected = [RankedCandidate(n, p, Quantity(0.0), "another fits better", measured=n == "mass")
                for n, p in (("mass", 0.04), ("none", 0.02), ("unknown", 0.01))]
    answer = effects[0].name if effects else verdict
    ranking = [RankedCandidate(answer, 0.93, Quantity(0.9, 0.8, 0.95)), *(r for r in rejected if r.name != answer)]
    whole = GapMap(tuple(cells), BASELINE, ("one.csv", "two.csv"))
    return Diagnosis(
        verdict, tuple(effects), tuple(ranking), (("mass", "thrust_coefficient"),), tuple(cells),
        {"before": 4.0, "after": 1.3, "floor": 1.0}, Quantity(0.9, 0.8, 0.95) if effects else None,
        Control("wind", Closure(4.0, 3.9, Quantity(0.03, -0.05, 0.1))),
        {"declared": Closure(4.0, 1.4, Quantity(0.87))}, ("a note",),
        ("no velocity",), ("one.csv", "two.csv"),
        map=whole, headline=headline or summary.headline(cells, bool(effects)),
        next=(NextStep("Weigh the <vehicle>.", "airtouch collect --mission hover"),), vehicle=VEHICLE.name, **more)


def of_flights(logs, effects=(FOUND,), **more):
    """A diagnosis with map and curves of flights."""
    study, flights = declared_study(VEHICLE, ()), [ready(f, VEHICLE) for f in logs]
    terms = [term_of(e) for e in effects]
    whole = gap_map(study, flights, terms=terms)
    result = diagnosis(whole.cells, effects=effects, **more)
    curves = curves_of(study, flights, [], terms, [result.headline, *whole.cells] if result.headline else [],
                       whole.cells)
    return replace(result, where=tuple(summary.cells_to_show(whole)), curves=curves)
