"""Fuzzes the log readers: mutated files of every format through read, check, segments, resample and the command.

    make fuzz-logs [RUNS=100000] [ARGS="--seed 2 --first 100000"]       # or: python tools/fuzz_logs.py --count 100000
    python tools/fuzz_logs.py --seed 1 --format usd-2 --only 4711
    python tools/fuzz_logs.py --shapes 100000

A thousand inputs of each format, as by default, take two to three minutes, 100,000 inputs take hours.

Prints per format the number of inputs, logs, refusals and failures, and the worst time and memory.
Exit code 1 when anything failed. One input is known by seed, format and number: the last line of a
failure is the command that repeats it, and --first goes on where a run ended. With --shapes, files made
to cost time or memory, so many samples, lines or parts long, go the same way. host/docs/fuzzing.md says what was found.
"""

import argparse
import os
import resource
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from random import Random

from airtouch.cli.shared.arguments import whole_number
from fuzzing.log_fuzzing import hostile, mutations, sound, usd_mutations, usd_old_mutations, walk

#: s of processor time for one input, and for each MB of it; no source: round numbers, some times what sound files take
MOST_S, MOST_S_PER_MB = 1.0, 10.0
MOST_MB, MOST_MB_PER_MB = 96.0, 400.0  #: MB above what the process held before, likewise
ADDRESS_SPACE = 6 << 30  #: bytes, a hard limit for the whole process
MEASURED = os.access("/proc/self/clear_refs", os.W_OK)  #: Linux tells a process its memory
COMMAND_EVERY = 50  #: each so many-th input also goes through `airtouch logs check` and `convert`, which take longer


@dataclass
class Count:
    """What became of one format's inputs."""

    log: int = 0
    refused: int = 0
    failed: int = 0
    worst_s: tuple[float, int] = (0.0, -1)
    worst_mb: tuple[float, int] = (0.0, -1)
    failures: dict[str, list[int]] = field(default_factory=dict)


def mutate(name: str, seed: int, number: int) -> tuple[bytes, Random]:
    """One input, and the generator for what the walk chooses."""
    r = Random(f"{seed} {name} {number}")
    base = r.choice(files_of(name))
    if name == "usd-0":
        return usd_old_mutations.usd_old(base, r), r
    if name.startswith("usd"):
        return usd_mutations.usd(base, r), r
    if name == "parquet":
        from fuzzing.log_fuzzing import parquet_mutations

        return parquet_mutations.parquet_file(base, r), r
    return (mutations.packed_text if name.endswith("gz") else mutations.text)(base, r), r


#: format -> its sound files
_FILES: dict[str, list[bytes]] = {}


def files_of(name: str) -> list[bytes]:
    """The sound files of one format, made once."""
    if name not in _FILES:
        _FILES[name] = list(sound.files(name))
    return _FILES[name]


def one(name: str, seed: int, number: int, folder: Path,
        command_every: int = COMMAND_EVERY) -> tuple[str, float, float]:
    """One input through readers and commands: outcome, seconds of processor time, MB of memory."""
    data, r = mutate(name, seed, number)

    def act(path: Path) -> str:
        """Walk the input, and call the commands on some."""
        outcome = walk.walk(data, str(path), r)
        if name == "thrust-stand" or number % command_every == 0:
            path.write_bytes(data)
        if number % command_every == 0:
            walk.command(["check", str(path), *(["--json"] if number % (2 * command_every) else [])], path)
            convert = ["convert", str(path), "--out", str(folder / "out"), "--force", "--format", "csv"]
            walk.command([*convert, "--rate", "100"], path)
        return walk.stand(path) if name == "thrust-stand" else outcome

    return measure(act, folder / "flight.log", len(data))


def measure(act: Callable[[Path], str], path: Path, size: int) -> tuple[str, float, float]:
    """What an act on a file of this size gives, its seconds of processor time and MB of memory, both within limits."""
    clear_peak()
    held, start = memory_mb("VmRSS"), time.process_time()
    outcome = act(path)
    seconds, mb = time.process_time() - start, memory_mb("VmHWM") - held
    assert seconds < MOST_S + MOST_S_PER_MB * size / 1e6, f"{seconds:.2f} s for {size} bytes"
    assert mb < MOST_MB + MOST_MB_PER_MB * size / 1e6, f"{mb:.0f} MB for {size} bytes"
    return outcome, seconds, mb


def clear_peak() -> None:
    """Start the process's peak of resident memory anew."""
    if MEASURED:
        Path("/proc/self/clear_refs").write_text("5")


def memory_mb(key: str) -> float:
    """A line of /proc/self/status in MB; 0 where there is none."""
    if not MEASURED:
        return 0.0
    with open("/proc/self/status") as status:
        return next(int(line.split()[1]) / 1024 for line in status if line.startswith(key))


def fuzz(name: str, seed: int, first: int, count: int, folder: Path) -> Count:
    """Inputs first to first + count - 1 of one format."""
    result = Count()
    walk.walk(files_of(name)[-1], name, Random(0))  # what is imported on the way counts for no input
    for number in range(first, first + count):
        if sys.stderr.isatty() and (number - first) % 500 == 0:
            print(f"\r{name}: {number - first} of {count} ", end="", file=sys.stderr, flush=True)
        try:
            outcome, seconds, mb = one(name, seed, number, folder)
        except Exception as error:
            result.failed += 1
            place = traceback.extract_tb(error.__traceback__)[-1]
            message = str(error).replace(str(folder), "")[:100]
            what = f"{type(error).__name__} at {Path(place.filename).name}:{place.lineno}: {message!r}"
            result.failures.setdefault(what, []).append(number)
            continue
        setattr(result, outcome, getattr(result, outcome) + 1)
        result.worst_s = max(result.worst_s, (seconds, number))
        result.worst_mb = max(result.worst_mb, (mb, number))
    return result


def shapes(length: int, folder: Path) -> int:
    """Every hostile file of one length. Raises AssertionError for one that goes over the limits."""
    print("shape                 bytes        s      MB  outcome")
    for name, make in hostile.HOSTILE.items():
        data = make(length)

        def act(path: Path, data: bytes = data) -> str:
            """Walk the file."""
            return walk.walk(data, str(path), Random(0))

        outcome, seconds, mb = measure(act, folder / "shape", len(data))
        print(f"{name:16}{len(data):11}{seconds:9.2f}{mb:8.0f}  {outcome}", flush=True)
    return 0


def main() -> int:
    """Fuzz the formats, or run one input or the hostile files; 1 where anything failed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1, help="of the mutations (default %(default)s)")
    parser.add_argument("--count", type=whole_number(1), default=1000, help="inputs of each format (default 1000)")
    parser.add_argument("--first", type=whole_number(0), default=0, help="number of the first input (default 0)")
    parser.add_argument("--format", choices=sound.FORMATS, action="append", help="only this format; may be repeated")
    instead = parser.add_mutually_exclusive_group()
    instead.add_argument("--shapes", type=whole_number(1), help="hostile files of this length instead of mutated ones")
    instead.add_argument("--only", type=whole_number(0),
                         help="one input, with its traceback; its bytes go to out/fuzzed.log")
    options = parser.parse_args()
    if options.only is not None and len(options.format or ()) != 1:
        parser.error("--only is a number of one format: give that with --format")
    resource.setrlimit(resource.RLIMIT_AS, (ADDRESS_SPACE, ADDRESS_SPACE))
    with tempfile.TemporaryDirectory() as folder:
        if options.only is not None:
            Path("out").mkdir(exist_ok=True)
            Path("out/fuzzed.log").write_bytes(mutate(options.format[0], options.seed, options.only)[0])
            print(one(options.format[0], options.seed, options.only, Path(folder), 1))
            return 0
        if options.shapes:
            return shapes(options.shapes, Path(folder))
        failed = 0
        print("format          inputs     logs  refused  failed  worst s (input)  worst MB (input)", flush=True)
        for name in options.format or sound.FORMATS:
            c = fuzz(name, options.seed, options.first, options.count, Path(folder))
            failed += c.failed
            print("\r" * sys.stderr.isatty()
                  + f"{name:13}{options.count:9}{c.log:9}{c.refused:9}{c.failed:8}{c.worst_s[0]:9.3f}"
                  f" {c.worst_s[1]:<7}{c.worst_mb[0]:10.1f} {c.worst_mb[1]}", flush=True)
            for what, numbers in sorted(c.failures.items(), key=lambda item: -len(item[1])):
                print(f"  {len(numbers)} times {what}\n    python tools/fuzz_logs.py --seed {options.seed} "
                      f"--format {name} --only {numbers[0]}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
