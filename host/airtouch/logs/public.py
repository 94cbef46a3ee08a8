"""The paper's authors' public flights: downloaded or copied from a folder, with every hash checked."""

import csv
import gzip
import hashlib
from collections.abc import Callable
from importlib import resources
from pathlib import Path

from airtouch.errors import AirTouchError
from airtouch.logs.files import MANIFEST, load_bytes, make_folder, write_bytes

REPOSITORY = "ChenyuZhaoTHU/crazyflie_filter_constant"
COMMIT = "b4c403e620fbce96d1539665b2fb342955ccf9ee"
BASE_URL = f"https://raw.githubusercontent.com/{REPOSITORY}/{COMMIT}/control/data/"

Progress = Callable[[str, str], None]


def registry() -> list[dict[str, str]]:
    """One row for each flight: `sha256` of the uncompressed CSV, and the columns of manifest.csv."""
    text = (resources.files("airtouch") / "logs" / "authors_flights.csv").read_text()
    return list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))


def fetch(
    out: Path, *, source: Path | None = None, base_url: str = BASE_URL, force: bool = False,
    progress: Progress | None = None
) -> dict[str, list[str]]:
    """Write the flights as `.csv.gz`, and their manifest.csv, to the folder `out`.

    source: a folder to copy them from (`.csv` or `.csv.gz`) instead of a download.
    force: replace files of these names that hold something else; damaged ones are replaced in any case.
    progress: called with (file, state) after each flight.

    Returns the file names by state: "present" (already there with the right hash), "new" and "failed"
    (missing at the source, or with a wrong hash; not written).
    No manifest.csv is written where there is no flight.
    Raises AirTouchError if `source` is no folder, if `out` has a manifest.csv of other flights or, without `force`, a
    file of the same name with other content, and if pooch is needed and not installed.
    """
    if source is not None and not source.is_dir():
        raise AirTouchError(f"{source}: no such folder; --from takes the folder that holds the CSV files")
    read = from_folder(source) if source is not None else _from_network(base_url)
    make_folder(out)
    _check_manifest(out / MANIFEST)
    present = _present(out, force)
    states: dict[str, list[str]] = {"present": [], "new": [], "failed": []}
    for row in registry():
        target = out / row["file"]
        state = "present" if row["file"] in present else _place(read, row, target)
        states[state].append(row["file"])
        if progress:
            progress(row["file"], state)
    if fetched := set(states["present"] + states["new"]):
        _write_manifest(out / MANIFEST, fetched)
    return states


def _place(read: Callable[[str, str], bytes | None], row: dict[str, str], target: Path) -> str:
    """Write a flight of the registry to `target`, gzipped: "new", or "failed" where its SHA-256 is another."""
    content = read(row["file"], row["sha256"])
    if content is None or hashlib.sha256(content).hexdigest() != row["sha256"]:
        return "failed"
    write_bytes(gzip.compress(content, 6, mtime=0), target, force=True)
    return "new"


def from_folder(folder: Path) -> Callable[[str, str], bytes | None]:
    """read(name, sha256) of files in a folder, packed or not: the content, None where it cannot be read or unpacked."""
    def read(name: str, sha256: str) -> bytes | None:
        for path in (folder / name, folder / name.removesuffix(".gz")):
            try:
                return load_bytes(path)
            except AirTouchError:
                continue
        return None

    return read


def _from_network(base_url: str) -> Callable[[str, str], bytes | None]:
    """read(name, sha256) of files below an address: the content, None where it cannot be fetched.

    Raises AirTouchError without the extra 'dataset'.
    """
    try:
        import pooch
    except ImportError:
        raise AirTouchError("fetching needs pooch: pip install 'airtouch[dataset]', or use --from DIR") from None
    import requests

    pooch.get_logger().setLevel("ERROR")
    cache = pooch.os_cache("airtouch")

    def read(name: str, sha256: str) -> bytes | None:
        plain = name.removesuffix(".gz")
        url = base_url + plain.replace("+", "%2B")
        try:
            return Path(pooch.retrieve(url, known_hash=f"sha256:{sha256}", fname=plain, path=cache)).read_bytes()
        except (OSError, ValueError, requests.RequestException):
            return None

    return read


def _manifest_lines() -> dict[str, str]:
    """File -> its line in manifest.csv, of every flight of the registry; under "file" the head."""
    columns = [name for name in registry()[0] if name != "sha256"]
    return {"file": ",".join(columns)} | {row["file"]: ",".join(_quote(row[name]) for name in columns)
                                          for row in registry()}


def _check_manifest(path: Path) -> None:
    """Raise AirTouchError for a manifest.csv with a line that `_write_manifest` does not write."""
    lines = load_bytes(path).decode(errors="replace").splitlines() if path.exists() else []
    if not {*lines} <= {*_manifest_lines().values()}:
        raise AirTouchError(f"{path}: not the manifest of these flights; choose another --out, or move it away")


def _present(out: Path, force: bool) -> set[str]:
    """The flights that are there already, by name.

    Raises AirTouchError, without `force`, for a file that has a flight's name, can be read, and is not that flight.
    """
    present = set()
    for row in registry():
        target = out / row["file"]
        try:
            content = load_bytes(target)
        except AirTouchError:
            continue
        if hashlib.sha256(content).hexdigest() == row["sha256"]:
            present.add(row["file"])
        elif not force:
            raise AirTouchError(f"{target}: another content than the published flight; use --force to replace it, or "
                                "choose another --out")
    return present


def _write_manifest(path: Path, present: set[str]) -> None:
    """Write the manifest.csv of the flights that are present."""
    lines = [line for file, line in _manifest_lines().items() if file in present | {"file"}]
    write_bytes(("\n".join(lines) + "\n").encode(), path, force=True)


def _quote(cell: str) -> str:
    return f'"{cell}"' if "," in cell else cell
