"""What goes before and after an adaptation: which flights can be used, and what more of them would be worth."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from airtouch import logs
from airtouch import vehicle as vehicles
from airtouch.detector import best
from airtouch.detector.evaluation import evaluate, summary
from airtouch.detector.evaluation.data.dataset import FlightFile
from airtouch.detector.shared import sensors
from airtouch.errors import AirTouchError
from airtouch.twin.adapt import Adapted, LoadedFlight
from airtouch.twin.fitting import calibrate
from airtouch.twin.recorded.course import course
from airtouch.vehicle import Vehicle


def readable(files: Sequence[FlightFile], speed_mps: float = 0.3, start: best.BestModel | None = None,
             progress: Callable[[int, int], None] = lambda *_: None,
             ) -> tuple[list[LoadedFlight], list[tuple[str, str]]]:
    """Flights that can be used, and (path, reason) of the others.

    A speed that is not stated comes from the log; speed_mps, m/s, where the log has no platform. start: the model that
    is trained further, None for none. progress: as progress(done, total).
    """
    usable, left_out = [], []
    for number, file in enumerate(files):
        progress(number + 1, len(files))
        try:
            log = logs.read(file.path)
            evaluate.check(log, best.SPARE_SENSORS, best.arm_pwm(start))
            speed = file.condition.speed_mps
            if speed is None and evaluate.truth(log):
                try:
                    speed = course(log).speed_mps
                except AirTouchError:
                    speed = speed_mps
            condition = replace(file.condition, speed_mps=speed or speed_mps)
            usable.append(LoadedFlight(FlightFile(file.path, condition), log))
        except AirTouchError as error:
            left_out.append((str(file.path), str(error)))
    return usable, left_out


def check_vehicle(twin: object, vehicle: object) -> None:
    """Raise AirTouchError for a twin and a vehicle together."""
    if twin is not None and vehicle is not None:
        raise AirTouchError("a twin has a vehicle of its own; leave --vehicle out")


def prepared(files: Sequence[FlightFile], out: Path, twin: Path | None, vehicle: Vehicle | str | Path | None, *,
             speed_mps: float | None, seed: int, bar: calibrate.Bars, start: best.BestModel | None = None,
             note: Callable[[str], None] = lambda _: None,
             ) -> tuple[list[LoadedFlight], list[tuple[str, str]], calibrate.Twin, Path]:
    """The flights to adapt to, (path, reason) of the others, the twin, and the folder of finished stages beside `out`.

    twin: its folder, else one is fitted, from a vehicle. start: as in `readable`. note: called with each reason. Raises
    AirTouchError where no flight can be used.
    """
    with bar("reading") as step:
        usable, left_out = readable(files, start=start, progress=lambda done, total: step(done, total, ""))
    for _, reason in left_out:
        note(reason)
    if not usable:
        first = f" ({left_out[0][1]})" if left_out else ""
        raise AirTouchError(f"no flight that can be trained on{first}; fly straight over a platform's two edges, with "
                            "acceleration, gyro and motors (one of the three may be missing) logged at 100 Hz")
    craft = vehicle if isinstance(vehicle, Vehicle) else vehicles.load(vehicle or vehicles.DEFAULT_VEHICLE)
    work = out.with_suffix(".adapt")
    return usable, left_out, twin_for(usable, twin, craft, work, speed_mps=speed_mps, seed=seed, bar=bar), work


def twin_for(usable: Sequence[LoadedFlight], folder: Path | None, vehicle: Vehicle, work: Path, *,
             speed_mps: float | None, seed: int, bar: calibrate.Bars) -> calibrate.Twin:
    """The twin in a folder, or else one fitted to those flights over a platform that have every sensor.

    The other arguments are those of `calibrate.of_flights`; vehicle: what the fit starts from.
    """
    if folder is not None:
        return calibrate.of_folder(folder)
    paths = [f.file.path for f in usable if f.labelled and not sensors.missing_sensors(f.log)]
    return calibrate.of_flights(paths, vehicle, work, speed_mps=speed_mps, seed=seed, bar=bar)


def expected_error(adapted: Adapted, labelled: int, more: int = 5) -> dict[str, float] | None:
    """Estimated mean error, m, with the present flights and with `more`, and the exponent p of error ~ flights^-p.

    Extrapolated from the errors with all and with half of the training flights; p is limited to 0 to 1. None without
    a hold-out.
    """
    if not adapted.held_out or not adapted.held_out_half:
        return None
    now, half = (summary.summarise(s)["mean_abs_error_m"] for s in (adapted.held_out, adapted.held_out_half))
    if not now or not half:
        return None
    exponent = float(np.clip(np.log2(half / now), 0.0, 1.0))
    return {"now_m": now, "half_m": half, "then_m": now * ((labelled + more) / labelled) ** -exponent,
            "exponent": exponent}
