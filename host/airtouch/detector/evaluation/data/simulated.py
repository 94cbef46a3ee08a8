"""Simulated training flights."""

from collections.abc import Callable, Sequence
from typing import Any

from airtouch import logs
from airtouch import vehicle as vehicles
from airtouch.detector.evaluation import evaluate
from airtouch.errors import AirTouchError
from airtouch.logs.flight_log import FlightLog
from airtouch.simulation import batch, scenario
from airtouch.simulation.flight import Diverged, choose
from airtouch.simulation.scenario import Scenario
from airtouch.vehicle import Vehicle

SCENARIO = "paper-mixed"
SPARE = 2  #: most simulated flights for each usable one

#: progress(stage, done, total, note)
Progress = Callable[[str, int, int, str], None]


def training_flights(
    count: int, name: str | Scenario = SCENARIO, *, vehicle: Vehicle | None = None, without: Sequence[str] = (),
    seed: int = 0, progress: Progress | None = None,
) -> tuple[list[FlightLog], dict[str, Any]]:
    """(the first `count` flights that end well and cross an edge, their description for a model's metadata).

    name: a built-in scenario, a .toml file or a scenario. vehicle: the default one if left out. without: effects of
    it to switch off. Same arguments, same flights. Held in memory: about 0.5 MB each.
    Raises AirTouchError for an effect that the scenario does not switch on, and where too few
    flights can be trained on.
    """
    if count < 1 or seed < 0:
        raise AirTouchError("simulated flights: at least one, with seed 0 or more")
    report = progress or (lambda *_: None)
    scene = name if isinstance(name, Scenario) else scenario.load(name)
    on = list(dict.fromkeys(effect for effect, _ in scenario.draw_flight(scene, seed, 0).effects))
    choose(scenario.draw_flight(scene, seed, 0), (), without)  # an unknown effect is named
    absent = [effect for effect in without if effect not in on]
    if absent:
        raise AirTouchError(f"{absent[0]} is off in {scene.name} already; on are: {', '.join(on) or 'none'}")
    arm_pwm = (vehicle or vehicles.load()).arm_pwm
    usable: list[FlightLog] = []
    left_out = 0
    for flight in batch.flights(scene, range(SPARE * count), vehicle=vehicle, without=without, seed=seed):
        if isinstance(flight, FlightLog) and _usable(flight, arm_pwm):
            usable.append(flight)
            report("simulated flights", len(usable), count, "")
        else:
            left_out += 1
        if len(usable) == count:
            break
    if len(usable) < count:
        raise AirTouchError(f"{scene.name}: only {len(usable)} of {SPARE * count} flights ended well and "
                            "crossed an edge; choose another scenario")
    return usable, {"scenario": scene.name, "flights": count, "seed": seed, "left_out": left_out,
                  "effects": [effect for effect in on if effect not in without], "without": list(without)}


def _usable(flight: FlightLog | Diverged, arm_pwm: float) -> bool:
    """Whether a flight ended well, crosses an edge and can be run through a detector that arms at `arm_pwm`."""
    if isinstance(flight, Diverged) or not logs.true_edges(flight, arm_pwm=arm_pwm):
        return False
    try:
        evaluate.check(flight, arm_pwm=arm_pwm)
    except AirTouchError:
        return False
    return True
