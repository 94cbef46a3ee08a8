"""Trains on simulated flights only, tests on recorded ones: with all effects of a scenario, and with each off.

    python tools/simulation/simulated_training.py --out out/simulated [--flights 90] [--steps 1000]
        [--detector best] [--without none --without ground_effect ...]

By default 24 trainings, `best` and `paper` with all effects and with each of the scenario's eleven off. A row that is
in --out already, for the same flights, settings and simulator sources, is not done again. Prints the table of
host/docs/simulation-checks.md.
"""

import argparse
import hashlib
import json
import time
from pathlib import Path
from typing import Any

import airtouch.simulation
from airtouch import vehicle as vehicles
from airtouch.cli.shared.arguments import whole_number
from airtouch.cli.shared.flights import need_flights
from airtouch.detector import registry
from airtouch.detector.evaluation import evaluate
from airtouch.detector.evaluation.data import dataset, simulated
from airtouch.detector.evaluation.summary import summarise
from airtouch.errors import AirTouchError, in_one_line, unknown
from airtouch.logs.files import make_folder, write_bytes
from airtouch.simulation import scenario

ALL = "none"  #: of --without: no effect is off


def sources() -> str:
    """Digest of the simulator: Python, scenarios, vehicles."""
    folder = Path(airtouch.simulation.__file__).parent
    hashed = hashlib.sha256(repr(vars(vehicles.load())).encode())
    for path in sorted([*folder.rglob("*.py"), *folder.rglob("*.toml")]):
        hashed.update(path.read_bytes())
    return hashed.hexdigest()


def effects_of(name: str) -> list[str]:
    """The effects that a scenario switches on."""
    plan = scenario.draw_flight(scenario.load(name), 0, 0)
    return list(dict.fromkeys(effect for effect, _ in plan.effects))


def row(detector: str, without: str, options: argparse.Namespace,
        files: list[dataset.FlightFile]) -> dict[str, Any]:
    """Figures of one training on the recorded flights, from the file of an earlier run if there is one."""
    own = {"epochs": options.epochs} if detector == "paper" else {"steps": options.steps}
    own = {name: value for name, value in own.items() if value is not None}
    settings = {"detector": detector, "without": without, "scenario": options.scenario,
                "flights": options.flights, "seed": options.seed, **own, "tested": [f.path.name for f in files]}
    key = hashlib.sha256((json.dumps(settings) + sources()).encode()).hexdigest()[:12]
    path = options.out / f"{detector}_without_{without}_{key}.json"
    if path.is_file():
        return json.loads(path.read_text())
    started = time.monotonic()
    flights, description = simulated.training_flights(options.flights, options.scenario, seed=options.seed,
                                                      without=() if without == ALL else (without,))
    module = registry.get(detector)
    model = module.fit(flights, seed=options.seed, command="tools/simulation/simulated_training.py", **own)
    scores, left_out = evaluate.evaluate(files, module, model)
    if left_out:
        raise AirTouchError(f"not scored: {left_out[0][1]}")
    figures = {**summarise(scores), "trained": description, "lag_s": module.lag_s(model), "options": own,
             "seconds": round(time.monotonic() - started)}
    write_bytes(json.dumps(figures, indent=1).encode(), path, force=True)
    return figures


def line(detector: str, without: str, result: dict[str, Any]) -> str:
    """One line of a Markdown table, 95 % intervals by flight."""
    def cell(name: str, scale: float, digits: int, unit: str = "") -> str:
        """A figure times `scale` with unit and interval."""
        interval = result["intervals"].get(name)
        if result[name] is None:
            return "-"
        value, *ends = (f"{scale * x:.{digits}f}" for x in (result[name], *(interval or ())))
        return f"{value}{unit}" + (f" ({ends[0]} to {ends[1]})" if ends else "")

    setting = "all on" if without == ALL else f"`{without}` off"
    cells = (f"{detector}, {setting}", cell("mean_abs_error_m", 1, 3, " m"), cell("missed", 100, 1, " %"),
             cell("false_per_minute", 1, 1), cell("balanced_accuracy", 100, 0, " %"), f"{result['lag_s']:.2f} s")
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Print each row as it is done."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/simulated"), help="finished rows are kept here")
    parser.add_argument("--scenario", default=simulated.SCENARIO, help="default paper-mixed")
    parser.add_argument("--flights", type=whole_number(1), default=90,
                        help="simulated flights to train on (default 90)")
    parser.add_argument("--steps", type=whole_number(1), help="best: training steps; its own number if left out")
    parser.add_argument("--epochs", type=whole_number(1), help="paper: epochs; its own number if left out")
    parser.add_argument("--detector", action="append", choices=("best", "paper"), help="default both")
    parser.add_argument("--without", action="append", metavar="EFFECT",
                        help="only these rows; none is all effects on")
    parser.add_argument("--seed", type=whole_number(0), default=0, help="of flights and training (default %(default)s)")
    options = parser.parse_args()
    choices = (ALL, *effects_of(options.scenario))
    if odd := [name for name in options.without or () if name not in choices]:
        raise unknown("effect of the scenario", odd[0], choices)
    make_folder(options.out)
    files = dataset.collect([need_flights()])
    started = False
    for detector in options.detector or ("best", "paper"):
        for without in options.without or choices:
            figures = row(detector, without, options, files)
            if not started:
                print(f"{options.flights} flights of {options.scenario}, seed {options.seed}; tested on "
                      f"{figures['flights']} recorded flights, {figures['edges']} edges\n\n"
                      "| trained with | mean absolute error | missed | false a minute | balanced accuracy "
                      "| lag |\n"
                      "|---|---|---|---|---|---|")
                started = True
            print(line(detector, without, figures), flush=True)


if __name__ == "__main__":
    with in_one_line("simulated_training"):
        main()
