"""`airtouch sitl` as a process: serves, ends on Ctrl-C, leaves the flight log."""

import signal
import socket
import subprocess
import sys

import pytest

from airtouch import logs
from airtouch.cli import main
from patience import HANG_S

ECHO = bytes([15 << 4 | 0x0C]) + b"hello"


def start(*arguments):
    program = "from airtouch.cli import main; main()"
    return subprocess.Popen([sys.executable, "-c", program, "sitl", *arguments],
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def test_serves_until_ctrl_c_and_records(tmp_path):
    path = tmp_path / "flight.csv"
    with start("paper-mixed", "--port", "0", "--effect", "wind:x=0.3m/s", "--without", "gust",
               "--fault", "late=1ms", "--record", str(path)) as process:
        uri = process.stdout.readline().split(": ")[0]
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
            client.settimeout(HANG_S)
            client.connect(("127.0.0.1", int(uri.rsplit(":", 1)[1])))
            client.send(ECHO)
            assert client.recv(100) == ECHO
            assert b"virtual Crazyflie" in client.recv(100)  # on the console
        process.send_signal(signal.SIGINT)
        out, error = process.communicate(timeout=HANG_S)
    assert process.returncode == 0, error
    assert str(path) in out and len(logs.read(path)) > 0


def test_bad_settings_are_one_line(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["airtouch", "sitl", "hover", "--port", "0", "--fault", "loss=3"])
    with pytest.raises(SystemExit) as ended:
        main()
    error = capsys.readouterr().err
    assert ended.value.code == 2 and error.count("\n") == 1 and "loss=0.3" in error
