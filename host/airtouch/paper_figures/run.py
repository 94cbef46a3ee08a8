"""Makes the figures, skips finished ones, and continues when a figure cannot be made."""

import hashlib
import importlib
import json
import multiprocessing
import os
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any

from airtouch import __version__
from airtouch.errors import AirTouchError, unknown
from airtouch.logs.files import in_folder, make_folder, write_bytes
from airtouch.paper_figures import claims, page, pictures, recorded
from airtouch.paper_figures.figure import Figure, Job, Missing, table_csv

#: name on the command line -> (module, function), in the order of the page
FIGURES = {
    "fig8a": ("overall", "heights"), "fig8b": ("materials", "overall"), "fig8c": ("overall", "against_baseline"),
    "fig8d": ("conditions", "by_height"), "fig8e": ("conditions", "by_angle"), "fig8f": ("materials", "by_pair"),
    "fig8g": ("components", "df_loss"), "fig8h": ("components", "time_resolution"),
    "fig8i": ("components", "input_size"),
    "sizes": ("sizes", "sizes"), "table1": ("table1", "power"), "wind": ("conditions", "wind"),
    "table2": ("resources", "resources"), "fig11b": ("vision", "light"),
    "fig11c": ("vision", "network_size"),
    "fusion": ("vision", "fusion"), "range": ("sensing_range", "sensing_range"),
}
#: figures that read recorded flights
RECORDED = {"fig8a", "fig8c", "fig8d", "fig8e", "fig8g", "fig8h", "fig8i", "sizes", "table2", "fig11c"}
#: figures that share trainings or films: one process makes each group; the longest first
GROUPS = (("fig8a", "fig8c", "fig8d", "fig8e", "sizes", "table2"), ("fig8g", "fig8h", "fig8i"),
          ("fig11b", "fig11c", "fusion"), ("fig8b", "fig8f"), ("wind",), ("table1",), ("range",))
#: one thread for each process, so that a figure does not depend on the number of cores
ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "TF_NUM_INTRAOP_THREADS", "TF_NUM_INTEROP_THREADS")


def names(only: Sequence[str]) -> list[str]:
    """The chosen figures in the order of the page; all of them if `only` is empty.

    Raises AirTouchError for an unknown name.
    """
    for name in only:
        if name not in FIGURES:
            raise unknown("figure", name, FIGURES)
    return [name for name in FIGURES if not only or name in only]


def run(chosen: Sequence[str], out: Path, job: Job, *, force: bool = False, command: str = "airtouch paper",
        workers: int = 1) -> dict[str, dict[str, Any]]:
    """Write figures as NAME.png, .svg, .csv and .json to `out`, and index.html of all figures there.

    Returns the records: name -> record. A figure with the same settings is not made again. A figure with missing or bad
    input has the reason in its record ("missing"), and the others are made. force: make the chosen figures anew, with
    an emptied work folder. workers: processes; `job.tell` must then be a function that can be pickled. Raises
    AirTouchError, before any work, if `out` holds a figure with other settings, without `force`, where it is not a
    figure of a quick run that a whole run replaces; and if a process dies. command: as it was typed, for the records of
    the figures that are made.
    """
    old = {name: record(out, name) for name in chosen}
    same = {name for name, entry in old.items() if entry and entry["key"] == settings_key(job, name)}
    stale = [name for name, entry in old.items() if entry and name not in same and "missing" not in entry
             and not (entry.get("quick") and not job.quick)]
    if stale and not force:
        raise AirTouchError(f"{out / stale[0]}.csv was made with other settings; use --force, or another --out")
    make_folder(out)
    if force:
        empty(job.work)
    done = [name for name, entry in old.items()
            if entry and name in same and "missing" not in entry and not force]
    for name in done:
        job.tell(f"{name}: done before")
    for variable in ONE_THREAD:  # TensorFlow, imported by the figures, reads them
        os.environ.setdefault(variable, "1")
    undone = [name for name in chosen if name not in done]
    groups = [part for group in GROUPS if (part := [name for name in undone if name in group])]
    if workers == 1 or len(groups) < 2:
        make_all(undone, job, out, command)
    else:
        _make_in_processes(groups, job, out, command, workers)
    all_records = records(out)
    page.write(out, all_records)
    return all_records


def empty(work: Path) -> None:
    """Delete the trainings, scores and crossings of the camera that earlier runs stored in their work folder."""
    for pattern in ("folds/*.json", "folds/*.npz", "vision_*.json"):
        for path in work.glob(pattern):
            path.unlink()


def make_all(chosen: Sequence[str], job: Job, out: Path, command: str) -> None:
    """Make figures one after the other, and write each with its record and the page to `out`."""
    for name in chosen:
        started, cpu_before = time.monotonic(), time.process_time()
        job.tell(f"{name} ...")
        entry = make(name, job, out)
        entry |= {"key": settings_key(job, name), "seconds": round(time.monotonic() - started, 1),
                  "cpu_seconds": round(time.process_time() - cpu_before, 1), "quick": job.quick, "command": command,
                  "version": __version__}
        write_bytes(json.dumps(entry, indent=1).encode(), out / f"{name}.json", force=True)
        page.write(out, records(out))
        job.tell(f"{name}: {entry.get('missing') or 'written'}, {entry['seconds']:.0f} s ({entry['cpu_seconds']:.0f} s "
                 "of processor time)")


def _make_in_processes(groups: Sequence[Sequence[str]], job: Job, out: Path, command: str, workers: int) -> None:
    """`make_all` for each group, in processes."""
    context = multiprocessing.get_context("spawn")  # a forked TensorFlow hangs
    with ProcessPoolExecutor(workers, mp_context=context) as pool:
        futures = [pool.submit(make_all, group, job, out, command) for group in groups]
        try:
            for future in as_completed(futures):
                future.result()
        except BrokenProcessPool:
            raise AirTouchError("a worker process died (memory? each needs up to 3 GB); call the same command again to "
                                "continue, with --workers 1 if it dies again") from None
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


def make(name: str, job: Job, out: Path) -> dict[str, Any]:
    """Make one figure: write its picture and table to `out`, and return its record."""
    module, function = FIGURES[name]
    verdicts: dict[str, dict[str, Any]] = {
        key: {"said": claim.text, "line": claim.line, "values": list(claim.values)}
        for key, claim in claims.of_figure(name).items()}
    try:
        figure: Figure = getattr(importlib.import_module(f"airtouch.paper_figures.figures.{module}"), function)(job)
    except AirTouchError as error:
        reason = str(error) if isinstance(error, Missing) else f"it could not be made: {error}"
        for record in verdicts.values():
            record |= {"verdict": claims.UNTESTABLE, "found": reason}
        return {"name": name, "title": name, "caption": "", "missing": reason, "claims": verdicts, "rows": []}
    if set(figure.verdicts) != set(verdicts):
        raise AirTouchError(f"{name}: verdicts of {', '.join(figure.verdicts)}, claims {', '.join(verdicts)}")
    for claim, verdict in figure.verdicts.items():
        verdicts[claim] |= {"verdict": verdict.verdict, "found": verdict.evidence, "judged": verdict.judged}
    png, svg = pictures.render(figure.draw)
    table = table_csv(figure.rows)
    for data, ending in ((png, "png"), (svg, "svg"), (table, "csv")):
        write_bytes(data, out / f"{name}.{ending}", force=True)
    head, *lines = page.cells(table)
    return {"name": name, "title": figure.title, "caption": figure.caption, "claims": verdicts,
            "rows": [dict(zip(head, line, strict=True)) for line in lines]}


def records(out: Path) -> dict[str, dict[str, Any]]:
    """Name -> record of all figures in a folder, in the order of the page."""
    return {name: entry for name in FIGURES if (entry := record(out, name))}


def record(out: Path, name: str) -> dict[str, Any] | None:
    """The record of a figure in a folder; None if it is missing or damaged, or if its files are missing."""
    try:
        entry = json.loads((out / f"{name}.json").read_text())
        whole = "missing" in entry or all((out / f"{name}.{e}").exists() for e in ("png", "svg", "csv"))
        return entry if whole and entry["claims"] is not None and entry["key"] else None
    except (OSError, ValueError, KeyError, TypeError):
        return None


def settings_key(job: Job, name: str) -> str:
    """Hash, of twelve hexadecimal digits, of everything that a figure depends on except the code.

    Of files that is their names, sizes and times: the recorded flights (the free-air ones too, which `best` is trained
    on in a whole run), or the power log, for the figures that read them.
    """
    files: list[Path] = []
    if name in RECORDED and job.flights is not None:
        files = sorted(job.flights.iterdir()) if job.flights.is_dir() else []
        for folder in () if job.quick else recorded.free_air_folders(job.flights):
            files += in_folder(folder, below=True)
    elif name == "table1" and job.power_log is not None:
        files = [job.power_log]
    total = hashlib.sha256(f"{__version__} {job.quick}".encode())
    for path in files:
        stat = path.stat() if path.exists() else None
        total.update(f"{path.name} {stat and (stat.st_size, stat.st_mtime_ns)}".encode())
    return total.hexdigest()[:12]
