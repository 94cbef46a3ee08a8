"""The public flights: hashes decide, whatever the source."""

import gzip
import hashlib
import threading
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer

import pytest
from click.testing import CliRunner

from airtouch.cli.dataset import fetch
from airtouch.errors import AirTouchError
from airtouch.logs import public


@pytest.fixture
def two_flights(monkeypatch):
    """A registry of two small flights, and their bytes."""
    content = {"a_+10d.csv.gz": b"1,2\n", "b.csv.gz": b"3,4\n"}
    rows = [{"sha256": hashlib.sha256(data).hexdigest(), "file": name, "use": "clean", "note": "one, two"}
            for name, data in content.items()]
    monkeypatch.setattr(public, "registry", lambda: rows)
    return content


def test_a_folder_of_plain_or_packed_files_is_taken_and_checked(two_flights, tmp_path):
    source, out = tmp_path / "source", tmp_path / "out"
    source.mkdir()
    (source / "a_+10d.csv").write_bytes(two_flights["a_+10d.csv.gz"])
    (source / "b.csv.gz").write_bytes(gzip.compress(b"tampered\n"))
    states = public.fetch(out, source=source)
    assert states == {"present": [], "new": ["a_+10d.csv.gz"], "failed": ["b.csv.gz"]}
    assert gzip.decompress((out / "a_+10d.csv.gz").read_bytes()) == b"1,2\n"
    assert not (out / "b.csv.gz").exists()
    assert '"one, two"' in (out / "manifest.csv").read_text()
    (source / "b.csv.gz").write_bytes(gzip.compress(two_flights["b.csv.gz"]))
    assert public.fetch(out, source=source)["present"] == ["a_+10d.csv.gz"]


def test_a_damaged_file_in_the_target_is_replaced(two_flights, tmp_path):
    source, out = tmp_path / "source", tmp_path / "out"
    source.mkdir()
    out.mkdir()
    (source / "b.csv").write_bytes(two_flights["b.csv.gz"])
    (out / "b.csv.gz").write_bytes(b"\x1f\x8bgarbage")
    assert "b.csv.gz" in public.fetch(out, source=source)["new"]


def test_a_file_of_the_same_name_with_other_content_stays_without_force(two_flights, tmp_path):
    source, out = tmp_path / "source", tmp_path / "out"
    source.mkdir()
    out.mkdir()
    for name, data in two_flights.items():
        (source / name.removesuffix(".gz")).write_bytes(data)
    mine = gzip.compress(b"mine\n")
    (out / "b.csv.gz").write_bytes(mine)
    arguments = ["--from", str(source), "--out", str(out)]
    refused = CliRunner().invoke(fetch, arguments).exception
    assert isinstance(refused, AirTouchError) and "b.csv.gz" in str(refused) and "--force" in str(refused)
    assert [p.name for p in out.iterdir()] == ["b.csv.gz"] and (out / "b.csv.gz").read_bytes() == mine
    assert CliRunner().invoke(fetch, [*arguments, "--force"]).exit_code == 0
    assert gzip.decompress((out / "b.csv.gz").read_bytes()) == two_flights["b.csv.gz"]


def test_a_manifest_of_other_flights_stays(two_flights, tmp_path):
    source, out = tmp_path / "source", tmp_path / "out"
    source.mkdir()
    out.mkdir()
    (source / "b.csv").write_bytes(two_flights["b.csv.gz"])
    (out / "manifest.csv").write_text("file,use\nmine.csv,clean\n")
    with pytest.raises(AirTouchError, match="not the manifest of these flights"):
        public.fetch(out, source=source)
    assert "mine.csv" in (out / "manifest.csv").read_text() and not (out / "b.csv.gz").exists()


def test_nothing_fetched_leaves_no_manifest(two_flights, tmp_path):
    source, out = tmp_path / "source", tmp_path / "out"
    source.mkdir()
    assert len(public.fetch(out, source=source)["failed"]) == 2
    assert not (out / "manifest.csv").exists()
    result = CliRunner().invoke(fetch, ["--from", str(source), "--out", str(tmp_path / "new" / "out")])
    assert isinstance(result.exception, AirTouchError) and not (tmp_path / "new").exists()


def test_flights_come_over_http_and_failures_are_listed(two_flights, tmp_path, monkeypatch):
    pooch = pytest.importorskip("pooch")
    monkeypatch.setattr(pooch, "os_cache", lambda name: tmp_path / "cache")
    served = tmp_path / "served"
    served.mkdir()
    (served / "a_+10d.csv").write_bytes(two_flights["a_+10d.csv.gz"])
    handler = partial(SimpleHTTPRequestHandler, directory=str(served))
    handler.log_message = lambda *args: None
    server = ThreadingHTTPServer(("127.0.0.1", 0), handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        states = public.fetch(tmp_path / "out", base_url=f"http://127.0.0.1:{server.server_port}/")
    finally:
        server.shutdown()
    assert states["new"] == ["a_+10d.csv.gz"] and states["failed"] == ["b.csv.gz"]


def test_a_file_that_cannot_be_written_is_one_line_and_leaves_nothing_behind(two_flights, tmp_path):
    source, out = tmp_path / "source", tmp_path / "out"
    source.mkdir()
    (out / "b.csv.gz").mkdir(parents=True)  # a folder of a flight's name
    (source / "b.csv").write_bytes(two_flights["b.csv.gz"])
    with pytest.raises(AirTouchError, match="b.csv.gz: is a folder"):
        public.fetch(out, source=source)
    assert [p.name for p in out.iterdir()] == ["b.csv.gz"]


def test_a_missing_source_folder_is_refused(tmp_path):
    with pytest.raises(AirTouchError, match="no such folder"):
        public.fetch(tmp_path / "out", source=tmp_path / "missing")


def test_the_registry_names_the_shared_flights(flights, tmp_path):
    states = public.fetch(tmp_path, source=flights / "airtouch")
    assert not states["failed"] and len(states["new"]) == len(public.registry())
