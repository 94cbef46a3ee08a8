"""The pipeline that flies: see `airtouch.reference.edge_pipeline`."""

from typing import Any

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.kernels.arrays import axes, column, float32, pointer, vehicle_struct
from airtouch.kernels.library import ffi, lib
from airtouch.parameters import DEFAULT
from airtouch.reference.band_power import band_bins
from airtouch.reference.edge_pipeline import EdgeEvents, EdgePipelineConfig, check_signals
from airtouch.reference.fr_cfar import check_settings
from airtouch.vehicle import Vehicle

MOST_BINS = 7  #: EDGE_PIPELINE_MAX_BINS of firmware/kernels/edge_pipeline.h


def _event_dtype() -> np.dtype:
    kinds = {"float": np.float32, "uint32_t": np.uint32, "uint8_t": np.uint8}
    names, formats, offsets = [], [], []
    for name, field in ffi.typeof("edgeEvent_t").fields:
        kind, shape = field.type, tuple[int, ...]()
        if kind.kind == "array":
            kind, shape = kind.item, (kind.length,)
        names.append(name)
        formats.append((kinds[kind.cname], shape))
        offsets.append(field.offset)
    return np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": ffi.sizeof("edgeEvent_t")})


def edge_pipeline(
    acc_world: np.ndarray,
    gyro: np.ndarray,
    pwm: np.ndarray,
    vehicle: Vehicle,
    *,
    vbat_v: np.ndarray | float | None = None,
    thrust_axis: np.ndarray | None = None,
    probability: np.ndarray | None = None,
    config: EdgePipelineConfig = EdgePipelineConfig(),
) -> EdgeEvents:
    """One flight through the C struct, sample by sample; float32, else as the reference."""
    acc, rate, motors = check_signals(acc_world, gyro, pwm)
    n = len(acc)
    samples = float32(np.column_stack([
        acc, rate, motors, column(vbat_v, n, "battery voltage"), axes(thrust_axis, n),
        column(probability, n, "probability")
    ]))
    events = np.zeros(n, dtype=_event_dtype())
    state = ffi.new("double[]", pipeline_ram_bytes() // 8 + 1)  # doubles, for their alignment
    result = lib.edgePipelineBatch(
        config_struct(config, vehicle), pointer(samples, "edgeSample_t *"), n, state, pointer(events, "edgeEvent_t *"))
    if result < 0:
        raise AirTouchError(
            f"pipeline: settings larger than the kernel's room (windows to {DEFAULT.band_window} samples, {MOST_BINS} "
            f"bins in the band, {DEFAULT.leading_window + DEFAULT.guard_cells} cells)")
    flag = {name: events[name].astype(bool)
            for name in ("ready", "alert", "alertRecent", "filtered", "armed")}
    return EdgeEvents(
        ready=flag["ready"], band_power=events["bandPower"], features=events["features"], force=events["force"],
        force_norm=events["forceNorm"], cfar_power=events["cfarPower"], threshold=events["threshold"],
        alert=flag["alert"], alert_recent=flag["alertRecent"], edge=events["edge"].astype(np.int64),
        filtered=flag["filtered"], armed=flag["armed"], non_finite=events["nonFinite"].astype(np.int64),
    )


def pipeline_ram_bytes() -> int:
    """RAM of the whole pipeline struct on this machine; a little less where pointers are four bytes."""
    return int(lib.edgePipelineSize())


def config_struct(config: EdgePipelineConfig, vehicle: Vehicle) -> Any:
    """An edgePipelineConfig_t; AirTouchError for settings that no pipeline can have."""
    p = config.parameters
    band_bins(p.sample_rate_hz, p.band_window, (p.band_low_hz, p.band_high_hz))
    check_settings(p.guard_cells, p.leading_window, p.p_fa)
    try:
        return ffi.new("edgePipelineConfig_t *", {
            "sampleRateHz": p.sample_rate_hz, "lowHz": p.band_low_hz, "highHz": p.band_high_hz, "pFa": p.p_fa,
            "forceMeanSamples": p.force_mean_samples, "armPwm": p.arm_pwm,
            "probabilityEntry": p.probability_entry, "probabilityExit": p.probability_exit,
            "window": p.band_window, "hop": p.band_hop, "leadingWindow": p.leading_window,
            "guardCells": p.guard_cells, "alertHold": p.alert_hold, "armSamples": p.arm_samples,
            "dwellSamples": p.dwell_samples, "cfarNorm": config.cfar_input == "norm",
            "physicalFilter": config.physical_filter, "vehicle": vehicle_struct(vehicle)[0],
        })
    except OverflowError as error:
        raise AirTouchError(f"pipeline: a setting is out of the kernel's range: {error}") from None
