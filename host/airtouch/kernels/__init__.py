"""The C kernels that fly, with the names and shapes of `airtouch.reference`; float32 out."""

from airtouch.kernels.band_power import BandPowerBank, band_power
from airtouch.kernels.cross_spectrum import cascaded_cross_spectrum
from airtouch.kernels.disturbance_force import disturbance_force, force_norm, total_thrust
from airtouch.kernels.edge_pipeline import edge_pipeline, pipeline_ram_bytes
from airtouch.kernels.feature_window import streaming_z_score, z_score_window
from airtouch.kernels.fr_cfar import fr_cfar, threshold_factor
from airtouch.kernels.stream import run_stream
from airtouch.kernels.stream_detector import edge_decoder, motion_channels, stream_detector

__all__ = [
    "BandPowerBank",
    "band_power",
    "cascaded_cross_spectrum",
    "disturbance_force",
    "edge_decoder",
    "edge_pipeline",
    "force_norm",
    "fr_cfar",
    "motion_channels",
    "pipeline_ram_bytes",
    "run_stream",
    "stream_detector",
    "streaming_z_score",
    "threshold_factor",
    "total_thrust",
    "z_score_window",
]
