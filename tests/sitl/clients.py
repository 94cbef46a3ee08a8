"""Helpers of the tests that speak to the virtual Crazyflie through cflib."""

import contextlib
import time

import pytest

from patience import HANG_S


@contextlib.contextmanager
def connected(uri, cache=None):
    """A cflib Crazyflie with its parameters fetched."""
    from cflib.crazyflie import Crazyflie
    from cflib.crazyflie.syncCrazyflie import SyncCrazyflie

    with SyncCrazyflie(uri, cf=Crazyflie(rw_cache=cache)) as scf:
        scf.wait_for_params()
        yield scf.cf


def wait_for(condition):
    """Poll until condition() holds; its value, or a failure where it hangs."""
    end = time.monotonic() + HANG_S
    while time.monotonic() < end:
        value = condition()
        if value:
            return value
        time.sleep(0.01)
    pytest.fail("it did not happen")


def log_block(cf, name, period_ms, variables, rows):
    """Start a block {variable: type}; (stamp, values) of each packet are appended to rows."""
    from cflib.crazyflie.log import LogConfig

    block = LogConfig(name, period_ms)
    for variable, kind in variables.items():
        block.add_variable(variable, kind)
    block.data_received_cb.add_callback(lambda stamp, values, _: rows.append((stamp, values)))
    cf.log.add_config(block)
    block.start()
    return block
