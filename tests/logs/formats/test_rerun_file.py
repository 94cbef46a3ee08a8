"""A flight as a Rerun recording, read back by Rerun itself; and the plain CSV, read back by pandas."""

import numpy as np
import pytest
from click.testing import CliRunner

import short_flights
from airtouch import logs
from airtouch.cli.logs import command


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


def test_pandas_reads_the_plain_table_back(flight, tmp_path):
    pandas = pytest.importorskip("pandas", reason="could not import pandas: pip install 'airtouch[pandas]'")
    convert(flight, "--format", "csv", "--plain", "--out", tmp_path)
    table, log = pandas.read_csv(tmp_path / "flight.csv"), logs.read(flight)
    assert list(table.columns) == list(log.columns)
    for name in log.columns:
        np.testing.assert_allclose(table[name].to_numpy(dtype=float), log[name], atol=1e-9)
