"""Flight logs: the schema, readers, writers, truth, segments and quality."""

from airtouch.logs.edges import Edge, true_edges
from airtouch.logs.files import read, write
from airtouch.logs.flight_log import FlightLog
from airtouch.logs.segments import airborne

__all__ = ["Edge", "FlightLog", "airborne", "read", "true_edges", "write"]
