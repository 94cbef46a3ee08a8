"""How often the diagnosis names a wake in nominal flights for which it is given seconds under another vehicle."""

from collections.abc import Iterator
from pathlib import Path

from airtouch import vehicle as vehicles
from airtouch.cli.shared.progress import with_bar
from airtouch.gap.evidence.data import Data
from airtouch.gap.flights.flight import ready
from airtouch.gap.naming.passing_effect import passing_evidence
from airtouch.gap.naming.policy import PASSING_GAIN
from airtouch.gap.nominal import calibrate
from airtouch.gap.passing import gates, overhead
from airtouch.gap.sealed.intervals import share_text
from airtouch.logs import read

from .. import cases
from ..result_store import Result, complete
from .tracks import LEAST_S, Track, overhead_at

Kind = tuple[str, str]  #: vehicle and manoeuvre of a flight
Seconds = tuple[tuple[float, float], ...]  #: from and to, s, of each stretch under another vehicle


def show_false_alarms(flights: Path, tracks: list[Track], store: Path | None) -> None:
    """Print how often the diagnosis names a wake in seconds of nominal flights, in which there is none.

    store: file of results, which are taken from there and appended (`result_store.complete`).
    """
    seconds_of: dict[Kind, list[Seconds]] = {}
    for t in (t for t in tracks if t.row.get("truth") == "downwash"):
        acts = overhead.intervals_s(overhead_at(t, tracks))
        if sum(b - a for a, b in acts) >= LEAST_S:
            seconds_of.setdefault((t.row["vehicle"], t.row["manoeuvre"]), []).append(acts)
    kind: dict[str, Kind] = {t.row["file"]: (t.row["vehicle"], t.row["manoeuvre"]) for t in tracks}
    nominal = {Path(case.flight).name: case for case in cases.nominal(flights, "build")}

    def run(todo: list[str]) -> Iterator[Result]:
        """The results of some flights, by their names, with a bar of progress."""
        return (alarms_of(nominal[name], seconds_of.get(kind[name], [])) for name in with_bar(todo, "nominal flights"))

    results = complete({name: name for name in nominal if name in kind}, run, lambda result: result["flight"], store)
    for result in results:
        print(f"{result['flight']}: {result['alarms']} of {result['trials']}")
    alarms, trials = (sum(result[number] for result in results) for number in ("alarms", "trials"))
    print(f"a wake named in nominal flights, seconds known: {share_text(alarms, trials, 1)}, "
          f"in {sum(result['alarms'] > 0 for result in results)} flights")


def alarms_of(case: cases.Case, seconds_overhead: list[Seconds]) -> Result:
    """In how many of these seconds the diagnosis names a wake in a nominal flight, and of how many."""
    vehicle = vehicles.load(case.vehicle)
    base = [ready(read(b), vehicle) for b in case.baseline]
    study, flight = calibrate.calibrated(vehicle, base)[0], ready(read(case.flight), vehicle)
    alarms = 0
    for seconds in seconds_overhead:
        data = Data(overhead.with_overhead(study, flight, seconds), [flight])
        wake = gates.passing_effects(data).get(gates.KNOWN_OVERHEAD)
        if wake is not None and passing_evidence(data, wake.key, wake.gain, wake.strength) >= PASSING_GAIN:
            alarms += 1
    return {"flight": Path(case.flight).name, "alarms": alarms, "trials": len(seconds_overhead)}
