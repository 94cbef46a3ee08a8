"""Prints the figures of classifiers that have CrazyPAD's labels: how far the diagnosis can reach its goals at all.

    python tools/diagnosis/gap_crazypad_ideal.py [FOLDER] [--part build|all]    # 5 min

Every flight is described by 63 numbers relative to the mean of the drone's other normal flights: hover balance,
unsteadiness, heave and corrections of `hover_pattern`, the voltage, commanded thrust of each rotor, and spectra of
commands and accelerations in seven bands. Four learners (a discriminant on the balance, one on all numbers, a forest,
the nearest flight) have the labels of (1) all other conditions of both drones, (2) all other flights, those of the
same condition too, (3) the other drone. The diagnosis has none. That several are tried and the best may be read
favours these tests. Intervals resample conditions within families. What the balance alone can tell:
`gap_crazypad_balance.py`. The figures are in host/docs/gap-crazypad.md.
"""

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
import numpy as np
from scipy.signal import welch

from airtouch import vehicle as vehicles
from airtouch.errors import in_one_line
from airtouch.gap.balance.hover_pattern import hover_pattern, stretches_in_air
from airtouch.gap.flights.flight import PERIOD_S, Flight, ready
from airtouch.gap.loop.command_spectra import MIX
from airtouch.logs import read
from recordings.crazypad import figures, labels
from recordings.learners import TREES, discriminant, forest, scikit, standardised
from recordings.result_store import Result

#: Hz, limits of the bands: those of `hover_pattern` below 2 Hz, octaves above, to half of the sample rate
BANDS_HZ = (0.3, 0.9, 2.0, 4.0, 8.0, 16.0, 30.0, 50.1)
WINDOW = 256  #: samples of a block of the spectra: 2.56 s, which resolves the lowest band
BALANCE = slice(0, 4)  #: lift, roll, pitch, yaw, the first numbers of a flight
RIDGE = 10.0  #: penalty of the regression on all (standardised) numbers; no source: round number


@dataclass(frozen=True)
class Table:
    """Flights with their labels.

    rows: the manifest's; numbers (flights, k): relative to the drone's other normal flights, the balance first.
    """

    rows: list[dict[str, str]]
    numbers: np.ndarray

    @property
    def drone(self) -> np.ndarray:
        """Drone of each flight."""
        return np.array([r["drone"] for r in self.rows])

    @property
    def family(self) -> np.ndarray:
        """Family of each flight's condition."""
        return np.array([labels.family(r["condition"]) for r in self.rows])

    @property
    def pair(self) -> np.ndarray:
        """Drone and condition of each flight, as one text."""
        return np.array([f"{r['drone']} {r['condition']}" for r in self.rows])

    @property
    def rotors(self) -> np.ndarray:
        """Damaged rotors as a text, empty for none."""
        return np.array(["".join(map(str, labels.rotors(r["condition"]))) for r in self.rows])

    @property
    def cut_mm(self) -> np.ndarray:
        """Millimetres cut off each flight's rotors, 0 where nothing is cut."""
        return np.array([np.nan_to_num(labels.cut_mm(r["condition"])) for r in self.rows])


def describe(flight: Flight, vehicle: vehicles.Vehicle) -> np.ndarray:
    """Numbers (k,) of one flight: its `HoverPattern`, voltage, thrust of each rotor, log10 of band powers."""
    weight = vehicle.mass_kg * vehicle.gravity_mps2 / 4.0
    thrust, voltage = vehicle.thrust(flight.pwm) / weight, flight.log["vbat_V"]
    levels, spectra = [], []
    for first, last in stretches_in_air(flight):
        mixed = thrust[first:last] @ MIX.T
        level = np.nanmean(voltage[first:last])
        slope = np.polyfit(np.arange(last - first) * PERIOD_S, np.nan_to_num(voltage[first:last], nan=level), 1)[0]
        levels.append([level, slope, *np.log(thrust[first:last].mean(axis=0))])
        signals = np.column_stack([mixed / mixed[:, :1].mean(), flight.acceleration[first:last]])
        f, p = welch(signals, 1.0 / PERIOD_S, nperseg=WINDOW, axis=0)
        spectra.append([np.log10(p[(f >= a) & (f < b)].mean(axis=0))
                        for a, b in zip(BANDS_HZ[:-1], BANDS_HZ[1:], strict=True)])
    return np.concatenate([hover_pattern(flight, vehicle).array(), np.mean(levels, axis=0),
                           np.mean(spectra, axis=0).ravel()])


def table_of(folder: Path, part: str) -> Table:
    """All flights, or those on which numbers may be chosen."""
    rows = labels.manifest(folder, part)
    vehicle = vehicles.load(labels.VEHICLE)
    return relative(rows, np.array([describe(ready(read(folder / r["file"]), vehicle), vehicle) for r in rows]))


def relative(rows: list[dict[str, str]], numbers: np.ndarray) -> Table:
    """The table of numbers (flights, k) less their mean over the drone's other normal flights."""
    return Table(rows, numbers - np.array([numbers[labels.baseline(rows, i)].mean(axis=0) for i in range(len(rows))]))


#: name -> classifier, made for the classes (flights,) that it learns
LEARNERS: dict[str, Callable] = {
    "discriminant on the balance": discriminant, "discriminant on all numbers": discriminant,
    "forest on all numbers": forest,
    "nearest flight, all numbers": lambda _: scikit("neighbors").KNeighborsClassifier(1)}
#: name -> regression of the millimetres cut
MEASURES: dict[str, Callable] = {
    "discriminant on the balance": lambda: scikit("linear_model").Ridge(1.0),
    "discriminant on all numbers": lambda: scikit("linear_model").Ridge(RIDGE),
    "forest on all numbers": lambda: scikit("ensemble").RandomForestRegressor(TREES, random_state=0),
    "nearest flight, all numbers": lambda: scikit("neighbors").KNeighborsRegressor(1)}


def cross_validate(table: Table, folds: list[np.ndarray], learner: str) -> list[Result]:
    """Results of all flights, each predicted by a learner that has the labels of all flights outside its fold."""
    x = table.numbers[:, BALANCE] if learner.endswith("the balance") else table.numbers
    out: list[Result] = [{} for _ in table.rows]
    for fold in folds:
        train = ~fold
        predicted = {}
        for label, values in (("family", table.family), ("rotors", table.rotors)):
            use = train & (table.family == "rotor damage") if label == "rotors" else train
            if len(set(values[use])) == 1:
                predicted[label] = np.full(fold.sum(), values[use][0])
                continue
            model = standardised(LEARNERS[learner](values[use]))
            predicted[label] = model.fit(x[use], values[use]).predict(x[fold])
        cut = standardised(MEASURES[learner]()).fit(x[train], table.cut_mm[train]).predict(x[fold])
        for i, family, rotors, mm in zip(np.flatnonzero(fold), predicted["family"], predicted["rotors"], cut,
                                         strict=True):
            out[i] = {**table.rows[i], **as_result(family, rotors, mm)}
    return out


def as_result(family: str, rotors: str, mm: float) -> Result:
    """A learner's prediction in the form of a diagnosis; millimetres stand for the loss of thrust."""
    if family == "normal":
        return {"verdict": "none", "effects": []}
    if family != "rotor damage":
        return {"verdict": "effect", "effects": [{"name": "mass" if family == "added weight" else "slung_load"}]}
    return {"verdict": "effect", "effects": [
        {"name": "weak_motor", "parameters": {"rotor": {"value": int(r)}, "thrust_loss": {"value": mm / len(rotors)}}}
        for r in rotors]}


def show_learners(table: Table, part: str, folds: list[np.ndarray]) -> None:
    """Print a line for each learner: the figures of `crazypad.figures` with their 90 % intervals."""
    print(f"\n{part}\n| test | family, balanced | of damage, right | exact rotors | severity, Spearman |\n"
          "|---|---|---|---|---|")
    for learner in LEARNERS:
        results = cross_validate(table, folds, learner)
        cells = []
        for figure in (figures.balanced_accuracy, _damage_right, figures.exact_rotors, figures.severity):
            cells.append(figures.with_interval(results, figure))
        print(f"| {learner} | " + " | ".join(cells) + " |", flush=True)


def _damage_right(results: list[Result]) -> float:
    """Share of flights with rotor damage that are called so."""
    right = [figures.answer(r) == "rotor damage" for r in results if labels.family(r["condition"]) == "rotor damage"]
    return float(np.mean(right)) if right else float("nan")


def show_distinct(table: Table) -> None:
    """Print how often the nearest other flight of a drone is of the same condition."""
    x = scikit("preprocessing").StandardScaler().fit_transform(table.numbers)
    for text, numbers in (("balance", x[:, BALANCE]), ("all numbers", x)):
        hits = []
        for i in range(len(x)):
            others = np.flatnonzero((table.drone == table.drone[i]) & (np.arange(len(x)) != i))
            nearest = others[np.argmin(((numbers[others] - numbers[i]) ** 2).sum(axis=1))]
            hits.append(table.pair[nearest] == table.pair[i])
        print(f"nearest other flight of the drone is of the same condition, {text}: {np.mean(hits):.2f} of {len(x)}")


def main() -> None:
    """Print the learners' figures, with less and with more labels known."""
    options = labels.folder_and_part(__doc__)
    scikit("ensemble")  # before the flights are read
    table = table_of(options.folder, options.part)
    pairs, n = sorted(set(table.pair)), len(table.rows)
    print(f"{n} flights, {len(pairs)} conditions of a drone, {table.numbers.shape[1]} numbers")
    show_learners(table, "(1) labels of all other conditions", [table.pair == p for p in pairs])
    show_learners(table, "(2) labels of all other flights", [np.arange(n) == i for i in range(n)])
    show_distinct(table)
    show_learners(table, "(3) labels of the other drone", [table.drone == d for d in sorted(set(table.drone))])


if __name__ == "__main__":
    with in_one_line("gap_crazypad_ideal"):
        main()
