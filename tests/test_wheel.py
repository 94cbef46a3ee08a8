"""The wheel: built from the archive of sources of this tree it holds all that detecting, diagnosing and simulating
read, and works away from the tree."""

import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

import short_flights
from airtouch import logs

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "host" / "airtouch"
DATA = ("py.typed", "vehicles/*.toml", "models/*", "report/*.html", "kernels/batch/*.h", "logs/*.csv",
        "simulation/scenarios/*.toml",
        "simulation/firmwares/*.toml", "crazyflie/missions/*.toml", "gap/signatures/*.toml", "simulation/effects/*.txt",
        "gap/edges/*.toml", "gap/example/*")

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def sdist(tmp_path_factory):
    """The archive of sources, of a tree in which nothing was built before: setuptools adds what an old list names."""
    out = tmp_path_factory.mktemp("sdist")
    tree = out / "tree"
    for name in ("firmware", "gap8", "host"):
        shutil.copytree(ROOT / name, tree / name, symlinks=True,
                        ignore=shutil.ignore_patterns("*.egg-info", "__pycache__", "*.so"))
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy2(ROOT / name, tree / name)
    build = f"from setuptools import build_meta; build_meta.build_sdist({str(out)!r})"
    subprocess.run([sys.executable, "-c", build], cwd=tree, check=True, timeout=600, stdout=subprocess.DEVNULL)
    (path,) = out.glob("airtouch-*.tar.gz")
    return path


@pytest.fixture(scope="module")
def wheel(sdist, tmp_path_factory):
    out = tmp_path_factory.mktemp("wheel")
    subprocess.run([sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "-w", out,
                    sdist], check=True, timeout=600)
    (path,) = out.glob("airtouch-*.whl")
    return path


@pytest.fixture(scope="module")
def unpacked(wheel, tmp_path_factory):
    """The wheel's files, first on the path of `run`: nothing of the tree is in reach."""
    out = tmp_path_factory.mktemp("installed")
    zipfile.ZipFile(wheel).extractall(out)
    # What Numba made of the same sources, which their sizes and times tell: else 25 s of compiling.
    for cached in (*PACKAGE.rglob("__pycache__/*.nb[ic]"), *PACKAGE.rglob("__pycache__/sources.stamp")):
        place = out / cached.relative_to(PACKAGE.parent)
        place.parent.mkdir(exist_ok=True)
        shutil.copy2(cached, place)
    for source in out.rglob("airtouch/**/*.py"):
        shutil.copystat(PACKAGE.parent / source.relative_to(out), source)
    return out


def run(unpacked, cwd, *arguments):
    start = (f"import sys; sys.path = [{str(unpacked)!r}, *(p for p in sys.path if {str(ROOT / 'host')!r} not in p)]; "
             "import airtouch; "
             f"assert airtouch.__file__.startswith({str(unpacked)!r}); from airtouch.cli import main; main()")
    return subprocess.run([sys.executable, "-c", start, *map(str, arguments)], cwd=cwd, capture_output=True, text=True,
                          timeout=600)


def test_every_module_and_every_file_of_data_is_in_it(wheel):
    names = set(zipfile.ZipFile(wheel).namelist())
    sources = [f for pattern in ("**/*.py", *DATA)
               for f in PACKAGE.glob(pattern) if f.is_file() and "__pycache__" not in f.parts]
    assert len(sources) > 200 and all(any(PACKAGE.glob(pattern)) for pattern in DATA)
    assert not [f for f in sources if str(f.relative_to(PACKAGE.parent)) not in names]


def test_the_kernels_are_compiled_and_no_test_is_in_it(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    assert [name for name in names if name.startswith("airtouch/kernels/_kernels") and name.endswith(".so")]
    assert {name.split("/")[0] for name in names} <= {"airtouch", f"{wheel.name.split('-cp')[0]}.dist-info"}
    assert wheel.stat().st_size < 10e6


def test_it_detects_and_simulates_away_from_the_tree(unpacked, tmp_path):
    logs.write(short_flights.fly(1)[0], tmp_path / "flight.csv.gz")
    for command in (("evaluate", "flight.csv.gz", "--speed", "0.3"),
                    ("simulate", "hover", "--out", "flown", "--workers", "1")):
        process = run(unpacked, tmp_path, *command)
        assert process.returncode == 0, process.stderr
    assert (tmp_path / "flown" / "hover_0_000000.csv.gz").is_file()
