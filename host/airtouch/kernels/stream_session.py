"""The streaming detector in C, kept open between samples: what runs live, on a drone's log or a file."""

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.kernels.arrays import pointer
from airtouch.kernels.library import ffi, lib
from airtouch.kernels.stream import arena_bytes, flat_stream
from airtouch.kernels.stream_detector import (
    EVENT,
    OTHER_NETWORK,
    StreamEvents,
    check_signals,
    decoder_struct,
    motion_struct,
    quantisation_struct,
)
from airtouch.reference.edge_decoder import DecoderConfig
from airtouch.reference.motion_channels import MotionConfig
from airtouch.reference.networks.stream_int8 import StreamNetwork


class StreamSession:
    """`stream_detector` in pieces: the same events whatever the pieces are.

    Raises AirTouchError for a network of another number of channels or fewer logits.
    """

    def __init__(self, network: StreamNetwork, motion: MotionConfig | None = None,
                 decoder: DecoderConfig = DecoderConfig()) -> None:
        flat, keep = flat_stream(network)
        arena = ffi.new("int8_t[]", arena_bytes(network))
        doubles = lib.streamSessionBytes() // 8 + 1  # for their alignment
        self._state = ffi.new("double[]", doubles)
        self._keep = (flat, keep, arena)  # the session points into these
        fits = lib.streamSessionOpen(self._state, motion_struct(motion or MotionConfig()), flat,
                                     quantisation_struct(network), decoder_struct(decoder), arena)
        if not fits:
            raise AirTouchError(OTHER_NETWORK)

    def next(self, acc_level: np.ndarray, gyro: np.ndarray, pwm: np.ndarray) -> StreamEvents:
        """Events of the next samples: (n, 3) m/s^2 in level axes, (n, 3) rad/s, (n, 4) PWM.

        Values that are not finite hold the last finite one.
        """
        acc, rate, motors = check_signals(acc_level, gyro, pwm)
        events = np.empty(len(acc), dtype=EVENT)
        lib.streamSessionNext(self._state, pointer(acc), pointer(rate), pointer(motors), len(acc),
                              pointer(events, "streamEvent_t *"))
        return StreamEvents(events["logits"], events["ready"] > 0, events["edge"], events["airborne"] > 0)
