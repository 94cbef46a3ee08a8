"""A flight as a Rerun recording (.rrd), for `rerun FILE.rrd`."""

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.extras import need
from airtouch.logs.edges import true_edges
from airtouch.logs.flight_log import FlightLog
from airtouch.parameters import DEFAULT

TIMELINE = "time"  #: name of the timeline; seconds since the log's first time


def recording(log: FlightLog, arm_pwm: float = DEFAULT.arm_pwm) -> bytes:
    """The bytes of an .rrd file: one scalar entity for each column, and the true edges as text under `edges`.

    NaN samples, and those without a time, are left out. arm_pwm: mean PWM above which its vehicle flies, for
    the edges. Raises AirTouchError for a log without any time, and without the extra 'rerun'.
    """
    need("rerun", "writing Rerun recordings")
    import rerun as rr

    known = log["t_s"][np.isfinite(log["t_s"])]
    if not len(known):
        raise AirTouchError(f"{log.source}: no sample has a time (t_s), which a Rerun recording needs")
    time_s = log["t_s"] - known[0]
    out = rr.RecordingStream("airtouch", recording_id=log.source)
    stream = out.binary_stream()
    for name, values in log.columns.items():
        there = np.isfinite(values) & np.isfinite(time_s)
        if name == "t_s" or not there.any():
            continue
        out.send_columns(name, indexes=[rr.TimeColumn(TIMELINE, duration=time_s[there])],
                         columns=rr.Scalars.columns(scalars=values[there]))
    edges = true_edges(log, arm_pwm=arm_pwm) if "zrange_m" in log.columns else []
    for edge in edges:
        out.set_time(TIMELINE, duration=float(time_s[edge.sample]))
        out.log("edges", rr.TextLog(edge.kind))
    out.flush()
    return stream.read()
