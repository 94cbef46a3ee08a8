"""How often the diagnosis names a wake in nominal flights for which it is given seconds under another vehicle."""

from pathlib import Path

from airtouch import vehicle as vehicles
from airtouch.gap.evidence.data import Data
from airtouch.gap.flights.flight import ready
from airtouch.gap.naming.passing_effect import passing_evidence
from airtouch.gap.naming.policy import PASSING_GAIN
from airtouch.gap.nominal import calibrate
from airtouch.gap.passing import gates, overhead
from airtouch.gap.sealed.intervals import share_text
from airtouch.logs import read

from .. import cases
from .tracks import LEAST_S, Track, overhead_at


def show_false_alarms(flights: Path, tracks: list[Track]) -> None:
    """Print how often the diagnosis names a wake in seconds of nominal flights, in which there is none."""
    seconds_of: dict[tuple[str, str], list[tuple[tuple[float, float], ...]]] = {}
    for t in (t for t in tracks if t.row.get("truth") == "downwash"):
        acts = overhead.stretches_s(overhead_at(t, tracks))
        if sum(b - a for a, b in acts) >= LEAST_S:
            seconds_of.setdefault((t.row["vehicle"], t.row["manoeuvre"]), []).append(acts)
    kind = {t.row["file"]: (t.row["vehicle"], t.row["manoeuvre"]) for t in tracks}
    alarms, trials = [], 0
    for case in cases.nominal(flights, "build"):
        name = Path(case.flight).name
        if name not in kind:
            continue
        vehicle = vehicles.load(case.vehicle)
        base = [ready(read(b), vehicle) for b in case.baseline]
        study, flight = calibrate.calibrated(vehicle, base)[0], ready(read(case.flight), vehicle)
        for seconds in seconds_of.get(kind[name], []):
            data = Data(overhead.with_overhead(study, flight, seconds), [flight])
            wake = gates.passing_effects(data).get(gates.KNOWN_OVERHEAD)
            trials += 1
            if wake is not None and passing_evidence(data, wake.key, wake.gain, wake.strength) >= PASSING_GAIN:
                alarms.append(name)
        print(f"{name}: {alarms.count(name)} of {len(seconds_of.get(kind[name], []))}", flush=True)
    print(f"a wake named in nominal flights, seconds known: {share_text(len(alarms), trials, 1)}, "
          f"in {len(set(alarms))} flights")
