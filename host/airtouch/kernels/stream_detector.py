"""Motion channels, decoder and the whole streaming detector in C, a flight in one call."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.kernels.arrays import float32, pointer, vehicle_struct
from airtouch.kernels.library import ffi, lib
from airtouch.kernels.stream import arena_bytes, flat_stream
from airtouch.reference.edge_decoder import LOGITS, DecoderConfig
from airtouch.reference.motion_channels import NAMES, MotionConfig
from airtouch.reference.networks.stream_int8 import StreamNetwork

#: error text for a network that the detector cannot run
OTHER_NETWORK = f"stream detector: the network must take {len(NAMES)} channels and give {len(LOGITS)} logits or more"


@dataclass(frozen=True)
class StreamEvents:
    """One event a sample: logits (n, 3), columns as LOGITS, held between steps; ready, airborne (n,) bool;
    edge (n,): 0 none, 1 entry, 2 exit."""

    logits: np.ndarray
    ready: np.ndarray
    edge: np.ndarray
    airborne: np.ndarray


def motion_channels(
    acc_level: np.ndarray, gyro: np.ndarray, pwm: np.ndarray, config: MotionConfig | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Channels (n, k) float32, k = len(NAMES), and airborne (n,) bool; see `airtouch.reference.motion_channels`."""
    acc, rate, motors = check_signals(acc_level, gyro, pwm)
    channels = np.empty((len(acc), len(NAMES)), dtype=np.float32)
    airborne = np.empty(len(acc), dtype=np.uint8)
    lib.motionChannelsBatch(pointer(acc), pointer(rate), pointer(motors), len(acc),
                            motion_struct(config or MotionConfig()), pointer(channels), pointer(airborne))
    return channels, airborne.astype(bool)


def edge_decoder(logits: np.ndarray, airborne: np.ndarray, config: DecoderConfig = DecoderConfig()) -> np.ndarray:
    """Edges (n,) of logits (n, 3), columns as LOGITS, and airborne (n,); see `airtouch.reference.edge_decoder`."""
    values, flags = float32(logits), np.ascontiguousarray(airborne, dtype=np.uint8)
    if values.shape != (len(flags), len(LOGITS)):
        raise AirTouchError(f"edge decoder: needs logits (n, {len(LOGITS)}) and airborne (n,), "
                            f"not {values.shape}, {flags.shape}")
    edges = np.empty(len(flags), dtype=np.uint8)
    lib.edgeDecoderBatch(pointer(values), pointer(flags), len(flags), decoder_struct(config), pointer(edges))
    return edges


def stream_detector(
    acc_level: np.ndarray, gyro: np.ndarray, pwm: np.ndarray, network: StreamNetwork,
    motion: MotionConfig | None = None, decoder: DecoderConfig = DecoderConfig(),
) -> StreamEvents:
    """A flight through the whole detector, sample by sample as the drone runs it.

    Raises AirTouchError for signals of another shape and for a network of another number of channels or fewer logits.
    """
    acc, rate, motors = check_signals(acc_level, gyro, pwm)
    flat, keep = flat_stream(network)
    arena = ffi.new("int8_t[]", arena_bytes(network))
    events = ffi.new("streamEvent_t[]", max(len(acc), 1))
    fits = lib.streamDetectorFlight(
        pointer(acc), pointer(rate), pointer(motors), len(acc), motion_struct(motion or MotionConfig()), flat,
        quantisation_struct(network), decoder_struct(decoder), arena, events)
    if not fits:
        raise AirTouchError(OTHER_NETWORK)
    table = np.frombuffer(ffi.buffer(events), dtype=EVENT)[:len(acc)]
    return StreamEvents(table["logits"].copy(), table["ready"] > 0, table["edge"].copy(), table["airborne"] > 0)


#: streamEvent_t as NumPy sees it
EVENT = np.dtype({"names": ["logits", "ready", "edge", "airborne"],
                  "formats": [("<f4", len(LOGITS)), "u1", "u1", "u1"],
                  "offsets": [ffi.offsetof("streamEvent_t", name) for name in ("logits", "ready", "edge", "airborne")],
                  "itemsize": ffi.sizeof("streamEvent_t")})


def motion_struct(config: MotionConfig) -> Any:
    """A motionConfig_t."""
    return ffi.new("motionConfig_t *", {
        "vehicle": vehicle_struct(config.vehicle)[0], "inverseScale": [1.0 / s for s in config.scale],
        "limit": config.limit, "armPwm": config.arm_pwm, "slowGain": 1.0 / config.slow_samples,
        "lagGain": 1.0 / config.lag_samples, "leastThrust": config.least_thrust_n,
        "settleSamples": config.settle_samples})


def quantisation_struct(network: StreamNetwork) -> Any:
    """A streamQuantisation_t: scales and zero points of the network's input and output."""
    first, head = network.layers[0], network.head
    return ffi.new("streamQuantisation_t *", {
        "inputScale": first.input_scale, "inputZeroPoint": first.input_zero_point,
        "outputScale": head.output_scale, "outputZeroPoint": head.output_zero_point})


def decoder_struct(config: DecoderConfig) -> Any:
    """A decoderConfig_t."""
    return ffi.new("decoderConfig_t *", {
        "overShare": config.over_share, "entryScore": config.entry_score, "exitScore": config.exit_score,
        "lateEntry": config.late_entry, "lateExit": config.late_exit, "smoothGain": config.smooth_gain,
        "dwellSteps": config.dwell_steps, "armSteps": config.arm_steps, "lookBack": config.look_back,
        "holdSteps": config.hold_steps})


def check_signals(acc: np.ndarray, gyro: np.ndarray, pwm: np.ndarray) -> tuple[np.ndarray, ...]:
    """The three as float32; AirTouchError for other shapes than (n, 3), (n, 3) and (n, 4)."""
    signals = float32(acc), float32(gyro), float32(pwm)
    n = len(signals[0])
    if [s.shape for s in signals] != [(n, 3), (n, 3), (n, 4)]:
        raise AirTouchError("stream detector: needs (n, 3) accelerations, (n, 3) rates and (n, 4) PWM, not "
                            + ", ".join(str(s.shape) for s in signals))
    return signals
