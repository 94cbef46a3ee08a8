"""Fuzzes the C that flies: builds the targets of tests/fuzz with sanitizers, runs them, and keeps what they find.

    make fuzz [TARGET="parser app"] [RUNS=1000000]        # or: python tools/fuzz.py parser app --runs 1000000
    make fuzz TARGET=app RESUME=1                         # goes on to RUNS inputs where an earlier run was ended
    python tools/fuzz.py app --replay build/fuzz/findings/app/crash-...
    python tools/fuzz.py --coverage                       # lines that the corpus reaches, source by source
    python tools/fuzz.py --minimise                   # the corpus, made small, becomes the seeds of tests/fuzz

A million inputs of one target take 1 to 8 minutes of processor time, all targets take hours.

With clang the engine is libFuzzer, which follows coverage; else a small driver of our own under the C compiler's
sanitizers, which only mutates the seeds. Everything is under build/fuzz: a corpus that grows from run to run, the
findings, the logs, and inputs.csv, which says how many inputs each program ran. host/docs/fuzzing.md says what the
targets promise. Any Python runs it, without the package: what it cannot do it refuses with SystemExit.
"""

import argparse
import csv
import hashlib
import os
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time
import zipfile
from dataclasses import dataclass, replace
from pathlib import Path

from fuzzing.fuzz_build import BUILD, FUZZ, LONG, ROOT, build, engine, product_sources, targets

SEEDS = FUZZ / "seeds"  #: archives of inputs, one for each target, in git
#: Little is kept of freed memory, and nothing of who took it: a fifth of the time of targets with packets. A replay
#: says it.
OPTIONS = {"UBSAN_OPTIONS": "print_stacktrace=1",
           "ASAN_OPTIONS": "quarantine_size_mb=2:thread_local_quarantine_size_kb=64:malloc_context_size=0"}
LONGEST = 2048  #: bytes of an input; no source: round number, a few packets or some ten samples
TIMEOUT = 20  #: seconds that one input may take before it counts as hanging; the slowest takes a few milliseconds
BATCH = 50_000  #: inputs that are run with one seed, and counted together; no source: round number, minutes of work
SEED_BYTES = 9_000  #: of a target's seeds in git, at most, with what the archive needs for each; no source: for size
ENTRY_BYTES = 110  #: of the archive


@dataclass(frozen=True)
class Result:
    """What one run of a target came to; edges and features are 0 without libFuzzer."""

    target: str
    inputs: int
    edges: int
    features: int
    cpu: float  # seconds
    finding: Path | None
    log: Path


def corpus(name: str, folder: Path | None = None) -> Path:
    """The folder of a target's corpus, with the kept seeds in it."""
    folder = (folder or BUILD) / "corpus" / name
    folder.mkdir(parents=True, exist_ok=True)
    seeds = SEEDS / f"{name}.zip"
    if seeds.exists():
        with zipfile.ZipFile(seeds) as archive:
            archive.extractall(folder)
    return folder


def run(name: str, program: Path, runs: int, seed: int = 1, folder: Path | None = None) -> Result:
    """Runs a target over its corpus and then `runs` inputs, which are those that count; stops at the first finding."""
    folder = folder or BUILD
    findings = folder / "findings" / name
    findings.mkdir(parents=True, exist_ok=True)
    before = set(findings.iterdir())
    log = folder / "logs" / f"{name}.txt"
    log.parent.mkdir(parents=True, exist_ok=True)
    inputs = corpus(name, folder)
    known = sum(1 for _ in inputs.iterdir())
    command: list[str | Path] = [
        program, f"-runs={runs + known}", f"-seed={seed}", f"-max_len={LONGEST}", f"-timeout={TIMEOUT}",
        "-rss_limit_mb=4096", "-print_final_stats=1", f"-artifact_prefix={findings}/", inputs]
    used = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    with log.open("w") as to:
        process = subprocess.run(command, stdout=to, stderr=to, env=os.environ | OPTIONS)
    cpu = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - used
    text = log.read_text(errors="replace")
    new = [path for path in findings.iterdir() if path not in before]
    if process.returncode and not new:
        raise SystemExit(f"{name} failed without a finding; see {log}\n{text[-2000:]}")
    executed = re.findall(r"stat::number_of_executed_units:\s*(\d+)", text)
    reached = re.findall(r"cov: (\d+) ft: (\d+)", text) or [("0", "0")]
    return Result(name, max(0, int(executed[-1]) - known) if executed else 0, int(reached[-1][0]), int(reached[-1][1]),
                  cpu, new[0] if process.returncode else None, log)


def run_batches(name: str, program: Path, runs: int, seed: int, resume: bool, folder: Path | None = None) -> Result:
    """Runs `runs` inputs in batches, each with the next seed, and notes each in inputs.csv; stops at the first finding.

    With resume, what inputs.csv says of this very program counts, so that a run that was ended goes on. The result's
    inputs and CPU time are those of all batches that count.
    """
    ledger = (folder or BUILD) / "inputs.csv"
    digest = hashlib.sha256(program.read_bytes()).hexdigest()[:16]
    before = []
    if resume and ledger.exists():
        with ledger.open() as lines:
            before = [line for line in csv.reader(lines) if line[:2] == [name, digest]]
    inputs, cpu = sum(int(line[3]) for line in before), sum(float(line[4]) for line in before)
    result = Result(name, inputs, 0, 0, cpu, None, ledger)
    for number in range(len(before), len(before) + runs):  # a batch has one input at least
        if inputs >= runs or result.finding:
            break
        result = run(name, program, min(BATCH, runs - inputs), seed + number, folder)
        with ledger.open("a") as lines:
            csv.writer(lines).writerow([name, digest, seed + number, result.inputs, round(result.cpu, 1),
                                        "found" if result.finding else "nothing found"])
        inputs, cpu = inputs + result.inputs, cpu + result.cpu
        if sys.stderr.isatty():
            print(f"\r{name}: {inputs} of {runs} ", end="", file=sys.stderr, flush=True)
    return replace(result, inputs=inputs, cpu=cpu)


def keep_seeds(name: str, program: Path) -> tuple[int, int]:
    """Merge the corpus and store its smallest inputs as the seeds in git; returns their number and bytes.

    Inputs that once failed stay seeds for good: new findings, and those that the seeds hold already.
    """
    inputs = corpus(name)
    permanent = {path.name: path.read_bytes() for path in inputs.glob("found-*")}
    findings = BUILD / "findings" / name
    for path in sorted(findings.iterdir()) if findings.is_dir() else []:
        permanent[f"found-{hashlib.sha256(path.read_bytes()).hexdigest()[:12]}"] = path.read_bytes()
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([program, "-merge=1", f"-max_len={LONGEST}", f"-artifact_prefix={BUILD}/", folder, inputs],
                       check=True, capture_output=True)
        SEEDS.mkdir(exist_ok=True)
        count, total = len(permanent), sum(len(content) + ENTRY_BYTES for content in permanent.values())
        with zipfile.ZipFile(SEEDS / f"{name}.zip", "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
            for path_name, content in sorted(permanent.items()):
                archive.writestr(zipfile.ZipInfo(path_name), content, zipfile.ZIP_DEFLATED)
            for path in sorted(Path(folder).iterdir(), key=lambda path: (path.stat().st_size, path.name)):
                total += path.stat().st_size + ENTRY_BYTES
                if total > SEED_BYTES:
                    break
                archive.writestr(zipfile.ZipInfo(path.name[:10]), path.read_bytes(), zipfile.ZIP_DEFLATED)
                count += 1
    return count, (SEEDS / f"{name}.zip").stat().st_size


def print_coverage(names: list[str]) -> None:
    """Print the fraction of lines of each source that the corpora reach, and the functions that none does."""
    made_by = engine("libfuzzer")
    profiler, reporter = (shutil.which(name) for name in ("llvm-profdata", "llvm-cov"))
    if made_by is None or profiler is None or reporter is None:
        raise SystemExit("coverage needs clang with libFuzzer, llvm-profdata and llvm-cov: apt-get install clang llvm")
    folder = BUILD / "coverage"
    programs = build(names, made_by, folder=folder, flags=("-fprofile-instr-generate", "-fcoverage-mapping"))
    for name, program in programs.items():
        subprocess.run([program, "-runs=0", f"-max_len={LONGEST}", f"-artifact_prefix={BUILD}/", corpus(name)],
                       check=True, capture_output=True,
                       env=os.environ | {"LLVM_PROFILE_FILE": str(folder / f"{name}.raw")})
    merged = folder / "all.profile"
    subprocess.run([profiler, "merge", *folder.glob("*.raw"), "-o", merged], check=True)
    objects = [word for name in names for word in ("-object", programs[name])]
    subprocess.run([reporter, "report", f"-instr-profile={merged}", *objects[1:], *product_sources()], check=True)


def main() -> None:
    """Build the targets and run, replay, keep or measure them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("targets", nargs="*", help=f"of {', '.join(targets())}; all by default")
    parser.add_argument("--runs", type=int, default=1_000_000, help="inputs of each target (1000000)")
    parser.add_argument("--seed", type=int, default=int(time.time()), help="of the mutations; the clock by default")
    parser.add_argument("--resume", action="store_true", help="what earlier runs of the same programs did counts")
    parser.add_argument("--engine", choices=["libfuzzer", "standalone"], default="",
                        help="(default: the best that this machine has)")
    instead = parser.add_mutually_exclusive_group()
    instead.add_argument("--replay", nargs="+", metavar="FILE", help="run these inputs once")
    instead.add_argument("--minimise", action="store_true", help="make the corpus small, as the seeds of tests/fuzz")
    instead.add_argument("--coverage", action="store_true", help="print which lines the corpus reaches")
    options = parser.parse_args()
    names = options.targets or list(targets())
    if unknown := set(names) - set(targets()):
        parser.error(f"no target {', '.join(sorted(unknown))}; there are {', '.join(targets())}")
    if options.runs < 1:
        parser.error("--runs must be at least 1")
    if absent := [path for path in options.replay or () if not Path(path).is_file()]:
        parser.error(f"{absent[0]}: no such file")
    if options.coverage:
        return print_coverage(names)
    made_by = engine(options.engine)
    if made_by is None:
        raise SystemExit("no compiler with sanitizers here: apt-get install clang")
    if options.minimise and made_by.name != "libfuzzer":
        raise SystemExit("--minimise needs clang with libFuzzer, which makes a corpus small: apt-get install clang")
    print(f"compiling {', '.join(names)}", file=sys.stderr, flush=True)
    programs = build(names, made_by, flags=LONG)
    if options.replay:
        sys.exit(max(subprocess.run([programs[name], *options.replay]).returncode for name in names))
    if options.minimise:
        for name in names:
            print("{}: {} seeds, {} bytes".format(name, *keep_seeds(name, programs[name])))
        return None
    print(f"{made_by.name}, {made_by.compiler}, mutations of seed {options.seed}\n"
          f"{'target':16} {'inputs':>9} {'edges':>6} {'features':>8} {'CPU s':>6}  result", flush=True)
    failed = False
    for name in names:
        result = run_batches(name, programs[name], options.runs, options.seed, options.resume)
        failed |= result.finding is not None
        verdict = "nothing found" if result.finding is None else (
            f"FOUND, see {result.log.relative_to(ROOT)}; replay: "
            f"python tools/fuzz.py {name} --replay {result.finding.relative_to(ROOT)}")
        print(f"{name:16} {result.inputs:9} {result.edges:6} {result.features:8} {result.cpu:6.0f}  {verdict}",
              flush=True)
    sys.exit(failed)


if __name__ == "__main__":
    main()
