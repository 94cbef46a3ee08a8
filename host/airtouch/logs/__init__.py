"""Flight logs: schema, readers, writers, true edges, phases of a flight, and quality checks."""

from airtouch.errors import in_python
from airtouch.logs import files
from airtouch.logs.checks.quality import Quality, check, summary
from airtouch.logs.edges import Edge, true_edges
from airtouch.logs.files import read
from airtouch.logs.flight_log import FlightLog
from airtouch.logs.in_flight import airborne
from airtouch.logs.resample import resample
from airtouch.logs.segments import Segment, segments

__all__ = ["Edge", "FlightLog", "Quality", "Segment", "airborne", "check", "read", "resample", "segments",
           "summary", "true_edges", "write"]
write = in_python(files.write)
