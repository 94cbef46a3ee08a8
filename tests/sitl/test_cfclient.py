"""The library code of cfclient, unmodified and without a display, in a process of its own.

Its headless client with a gamepad that we move, the reader of its log configurations and the
writer of log files. Windows and tabs (cfclient.ui) need a display and are not started.
"""

import json
import os
import subprocess
import sys
from itertools import pairwise

import pytest

from airtouch.sitl import serve
from patience import HANG_S

SCRIPT = r"""
import datetime, json, pathlib, sys, threading, time
import cfclient
from cflib.crazyflie.log import LogConfig
from cfclient.headless import HeadlessClient
from cfclient.utils.logconfigreader import LogConfigReader
from cfclient.utils.logdatawriter import LogWriter

def wait_for(condition):
    end = time.monotonic() + float(sys.argv[2])
    while not condition():
        if time.monotonic() > end:
            raise SystemExit("it did not happen")
        time.sleep(0.01)

client = HeadlessClient()
cf, reader = client._cf, LogConfigReader(client._cf)
client.connect_crazyflie(sys.argv[1])
wait_for(lambda: cf.param.is_updated)
block = next(b for b in reader.getLogConfigs() if b.name == "stabilizer")
assert block.valid  # the reader has given it to the drone's table of contents
writer = LogWriter(block, datetime.datetime.now())
writer.start()
rows = []
block.data_received_cb.add_callback(lambda stamp, values, _: rows.append(values))
block.start()
wait_for(lambda: len(rows) > 20)
writer.stop()
# a gamepad's assisted mode, then its thrust after it was zero
client._jr.assisted_control_updated.call(False)
wait_for(lambda: cf.param.get_value("flightmode.althold") == "0")
flying = LogConfig("flying", 10)
flying.add_variable("sys.isFlying", "uint8_t")
flies = threading.Event()
flying.data_received_cb.add_callback(lambda stamp, values, _: values["sys.isFlying"] and flies.set())
cf.log.add_config(flying)
flying.start()

def push(thrust):
    client._jr.input_updated.call(0.0, 0.0, 0.0, thrust)
    return flies.is_set()

for _ in range(5):
    push(0)
wait_for(lambda: push(55000))
files = [path.read_text() for path in (pathlib.Path(cfclient.config_path) / "logdata").rglob("*.csv")]
print(json.dumps({"names": sorted(rows[0]), "files": files}), file=sys.stderr)
cf.close_link()
"""


def test_headless_client_log_configurations_and_log_files(tmp_path):
    pytest.importorskip("cfclient")
    environment = {**os.environ, "HOME": str(tmp_path), "XDG_CONFIG_HOME": str(tmp_path),
                   "QT_QPA_PLATFORM": "offscreen"}
    with serve("hover", port=0, without=["gust"]) as virtual:
        process = subprocess.run([sys.executable, "-c", SCRIPT, virtual.uri, str(HANG_S)], env=environment,
                                 timeout=HANG_S, capture_output=True, text=True)
        assert process.returncode == 0, process.stderr[-2000:]
        assert virtual.drone.took_off_s is not None
    report = json.loads(process.stderr.strip().splitlines()[-1])
    assert report["names"] == ["stabilizer.pitch", "stabilizer.roll", "stabilizer.yaw"]
    header, *lines = report["files"][0].splitlines()
    assert header == "Timestamp,stabilizer.roll,stabilizer.pitch,stabilizer.yaw"
    stamps = [int(line.split(",")[0]) for line in lines]
    assert len(stamps) > 15 and {b - a for a, b in pairwise(stamps)} == {20}
