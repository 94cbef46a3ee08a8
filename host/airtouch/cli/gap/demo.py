"""`airtouch gap demo`: a diagnosis of flights of the package."""

from pathlib import Path

import click

from airtouch.cli.gap.options import check_all_free
from airtouch.cli.gap.progress import StepLines
from airtouch.cli.shared import output
from airtouch.cli.shared.help import examples
from airtouch.cli.shared.typed import typed


@click.command("demo", epilog=examples(
    "airtouch gap demo",
    "airtouch gap demo --out again"))
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), default=Path("out/gap-demo"),
              show_default=True, help="Folder for the report and the JSON.")
@click.option("--force", is_flag=True, help="Replace what an earlier demo wrote.")
def demo_command(out: Path, force: bool) -> None:
    """Diagnose a flight of the package whose effect is withheld, and compare the answer with the effect.

    Needs no drone, no network and no TensorFlow; about a minute, most of it compiling the first time.
    """
    import time

    from airtouch.gap import example

    report, json_path = out / "report.html", out / "diagnosis.json"
    check_all_free((report, json_path), force)
    began = time.monotonic()
    line = f"airtouch gap diagnose {example.real()} --baseline {example.FOLDER / 'nominal_*.csv.gz'} --report {report}"
    click.echo(f"This is: {line}")
    with StepLines(began) as say:
        say("reading and compiling")
        from airtouch.cli.gap import show
        from airtouch.gap.answer import words
        from airtouch.gap.diagnosis import diagnose
        from airtouch.logs import read
        from airtouch.report import gap_report
        from airtouch.vehicle import load

        nominal = [read(p) for p in example.nominal()]
        diagnosis = diagnose([read(example.real())], load(str(nominal[0].meta["vehicle"])), nominal, progress=say,
                             curves=True)
        say("report")
        output.write_json(json_path, diagnosis.plain(), force)
        gap_report.write_diagnosis(report, diagnosis, command=typed(), force=force)
    show.diagnosis(output.console(), diagnosis)
    true = {name: ", ".join(f"{k} {v:g}" for k, v in p.items()) for name, p in example.answer().items()}
    answer = words.joined([e.name for e in diagnosis.effects]) or diagnosis.verdict
    click.echo(f"\nSwitched on when the flight was made: {'; '.join(f'{n} ({p})' for n, p in true.items())}; found: "
               f"{answer}.")
    click.echo(f"{time.monotonic() - began:.0f} s; open {report} in a browser")
