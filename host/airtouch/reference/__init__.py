"""NumPy and SciPy definitions of every kernel; `airtouch.kernels` has the same names in C."""

from airtouch.reference.band_power import band_bins, band_power, window_ends
from airtouch.reference.cross_spectrum import cascaded_cross_spectrum
from airtouch.reference.disturbance_force import disturbance_force, force_norm, total_thrust
from airtouch.reference.edge_decoder import DecoderConfig, edge_decoder
from airtouch.reference.edge_pipeline import EdgeEvents, EdgePipelineConfig, edge_pipeline
from airtouch.reference.feature_window import streaming_z_score, z_score_window
from airtouch.reference.finite import hold_finite
from airtouch.reference.fr_cfar import fr_cfar, threshold_factor
from airtouch.reference.motion_channels import MotionConfig, motion_channels
from airtouch.reference.networks.stream_int8 import StreamNetwork, run_stream

__all__ = [
    "DecoderConfig",
    "EdgeEvents",
    "EdgePipelineConfig",
    "MotionConfig",
    "StreamNetwork",
    "band_bins",
    "band_power",
    "cascaded_cross_spectrum",
    "disturbance_force",
    "edge_decoder",
    "edge_pipeline",
    "force_norm",
    "fr_cfar",
    "hold_finite",
    "motion_channels",
    "run_stream",
    "streaming_z_score",
    "threshold_factor",
    "total_thrust",
    "window_ends",
    "z_score_window",
]
