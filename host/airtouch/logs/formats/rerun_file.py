"""A flight as a Rerun recording (.rrd), for `rerun FILE.rrd`."""

import numpy as np

from airtouch.extras import need
from airtouch.logs.edges import true_edges
from airtouch.logs.flight_log import FlightLog

TIMELINE = "time"  #: name of the timeline; seconds since the log's first sample


def recording(log: FlightLog) -> bytes:
    """The bytes of an .rrd file: one scalar entity for each column, and the true edges as text under `edges`.

    NaN samples are left out. Raises AirTouchError without the extra 'rerun'.
    """
    need("rerun", "writing Rerun recordings")
    import rerun as rr

    time_s = log["t_s"] - log["t_s"][0]
    out = rr.RecordingStream("airtouch", recording_id=log.source)
    stream = out.binary_stream()
    for name, values in log.columns.items():
        there = np.isfinite(values) & np.isfinite(time_s)
        if name == "t_s" or not there.any():
            continue
        out.send_columns(name, indexes=[rr.TimeColumn(TIMELINE, duration=time_s[there])],
                         columns=rr.Scalars.columns(scalars=values[there]))
    edges = true_edges(log) if "zrange_m" in log.columns else []
    for edge in edges:
        out.set_time(TIMELINE, duration=float(time_s[edge.sample]))
        out.log("edges", rr.TextLog(edge.kind))
    out.flush()
    return stream.read()
