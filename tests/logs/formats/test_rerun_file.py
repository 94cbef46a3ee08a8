"""A flight as a Rerun recording, read back by Rerun itself; and the plain CSV, read back by pandas."""

import sys
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner

import short_flights
from airtouch import logs
from airtouch.cli.logs import command
from airtouch.errors import AirTouchError
from airtouch.logs.flight_log import PWM
from airtouch.logs.formats import rerun_file


@pytest.fixture(scope="module")
def flight(tmp_path_factory):
    path = tmp_path_factory.mktemp("rerun") / "flight.csv"
    log = short_flights.fly(1)[0]
    log.columns["vx_mps"][50:60] = np.nan
    logs.write(log, path)
    return path


def convert(*arguments):
    result = CliRunner().invoke(command, ["convert", *map(str, arguments)])
    assert result.exception is None, result.exception


def test_rerun_reads_every_sample_back(flight, tmp_path):
    chunk = pytest.importorskip("rerun.chunk", reason="could not import rerun: pip install 'airtouch[rerun]'")
    convert(flight, "--format", "rrd", "--out", tmp_path)
    log, samples = logs.read(flight), {}
    for piece in chunk.RrdReader(tmp_path / "flight.rrd").store().stream().to_chunks():
        table = piece.to_record_batch()
        columns = dict(zip(table.schema.names, table.columns, strict=True))
        time = next((c for n, c in columns.items() if n == "time"), None)
        for name, values in columns.items():
            if time is not None and ("Scalars" in name or "TextLog:text" in name):
                entity = piece.entity_path.strip("/")
                times, numbers = samples.setdefault(entity, ([], []))
                times += [t.total_seconds() for t in time.to_pylist()]
                numbers += [v[0] for v in values.to_pylist()]
    for name in ("gyro_x_radps", "m1_pwm", "zrange_m", "vx_mps"):
        order = np.argsort(samples[name][0])
        there = np.isfinite(log[name])
        np.testing.assert_allclose(np.array(samples[name][1])[order], log[name][there], atol=1e-9)
        np.testing.assert_allclose(np.array(samples[name][0])[order], (log["t_s"] - log["t_s"][0])[there], atol=1e-6)
    assert len(samples["vx_mps"][0]) == len(log) - 10
    assert samples["edges"][1] == [edge.kind for edge in logs.true_edges(log)]


@pytest.fixture
def sent(monkeypatch):
    """What Rerun is given, by entity: seconds and values of each channel, and the edges; Rerun itself is not needed."""
    sent, now = {}, [0.0]

    def send_columns(name, indexes, columns):
        sent[name] = (indexes[0], columns)

    stream = SimpleNamespace(binary_stream=lambda: SimpleNamespace(read=lambda: b"rrd"), send_columns=send_columns,
                             set_time=lambda _, duration: now.__setitem__(0, duration), flush=lambda: None,
                             log=lambda name, text: sent.setdefault(name, []).append((now[0], text)))
    fake = SimpleNamespace(RecordingStream=lambda *_, **__: stream, TimeColumn=lambda _, duration: duration,
                           Scalars=SimpleNamespace(columns=lambda scalars: scalars), TextLog=lambda text: text)
    monkeypatch.setitem(sys.modules, "rerun", fake)
    monkeypatch.setattr(rerun_file, "need", lambda *_: None)
    return sent


def test_a_first_sample_without_a_time_costs_no_other(flight, sent):
    log = logs.read(flight)
    log.columns["t_s"] = log["t_s"] + 7.0
    log.columns["t_s"][:3] = np.nan
    rerun_file.recording(log)
    times, values = sent["zrange_m"]
    there = np.isfinite(log["zrange_m"]) & np.isfinite(log["t_s"])
    np.testing.assert_allclose(values, log["zrange_m"][there])
    assert times[0] == 0.0 and times[-1] == pytest.approx(0.01 * (len(log) - 4), abs=0.02)
    log.columns["t_s"][:] = np.nan
    with pytest.raises(AirTouchError, match="no sample has a time"):
        rerun_file.recording(log)


def test_the_edges_of_a_recording_go_by_the_arm_pwm(flight, sent):
    """A light vehicle hovers at 9,000; only a spin-up passes the default."""
    log = logs.read(flight)
    for motor in PWM:
        log.columns[motor] = np.full(len(log), 9000.0)
        log.columns[motor][100:110] = 20000.0
    rerun_file.recording(log)
    assert "edges" not in sent
    rerun_file.recording(log, arm_pwm=8000.0)
    assert [kind for _, kind in sent["edges"]] == ["entry", "exit"]


def test_convert_hands_over_the_arm_pwm_of_the_vehicle(flight, tmp_path, monkeypatch):
    handed = []
    monkeypatch.setattr(rerun_file, "recording", lambda log, arm_pwm: handed.append(arm_pwm) or b"rrd")
    monkeypatch.setattr("airtouch.extras.need", lambda *_: None)
    monkeypatch.setattr("airtouch.cli.logs.arm_pwm_of", lambda meta: 12345.0)
    convert(flight, "--format", "rrd", "--out", tmp_path)
    assert handed == [12345.0]


def test_pandas_reads_the_plain_table_back(flight, tmp_path):
    pandas = pytest.importorskip("pandas", reason="could not import pandas: pip install 'airtouch[pandas]'")
    convert(flight, "--format", "csv", "--plain", "--out", tmp_path)
    table, log = pandas.read_csv(tmp_path / "flight.csv"), logs.read(flight)
    assert list(table.columns) == list(log.columns)
    for name in log.columns:
        np.testing.assert_allclose(table[name].to_numpy(dtype=float), log[name], atol=1e-9)
