"""The cores of the two apps: what the STM32 and the GAP8 run, called from Python sample by sample.

    app, gap8 = AppCore(have_gap8=True), Gap8Core()
    edge = app.step(acc, gyro, pwm, vbat_v=3.9)     # one sample of 100 Hz
    for packet in app.packets():
        reply = gap8.take(packet)
        if reply:
            app.receive(reply)
    app.log.probability                              # every value of the LOG group `airtouch`

There is one such object for each virtual drone; none of them waits or fails.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.kernels.arrays import vehicle_struct
from airtouch.kernels.library import ffi, lib
from airtouch.vehicle import Vehicle

DETECTORS = ("cfar", "best", "best-gap8", "paper-gap8", "paper-stream-gap8")  #: values of the parameter `detector`
EDGES = ("none", "entry", "exit", "edge")  #: values of the log variable `edge`
LINK = ("starting", "filling", "up", "down", "refused")  #: values of the log variable `link`
HEALTH = {  #: bits of the log variable `health`
    "non-finite": 1, "link down": 2, "link filling": 4, "model refused": 8, "parameter clamped": 16,
    "no GAP8": 32, "packet dropped": 64, "late": 128, "stalled": 256, "no sensor": 512,
    "no horizontal": 1024, "other vehicle": 2048,
}
PACKETS = 2  #: packets that the app sends in a step, at most
Numbers = Sequence[float] | np.ndarray
UNKNOWN = (np.nan,) * 4
MOST = {"uint8_t": 255, "uint16_t": 65_535}  #: of the integer parameters


class AppCore:
    """The STM32 app's core (firmware/app/core/app_core.h)."""

    def __init__(self, params: dict[str, float] | None = None, have_gap8: bool = False, nonce: int = 1,
                 vehicle: Vehicle | None = None) -> None:
        """params: fields of appParams_t that differ from the shipped ones. vehicle: what the app is built for, the one
        that the networks were trained for if left out."""
        self._memory = ffi.new("double[]", lib.appHostBytes() // 8 + 1)  # doubles, for their alignment
        self._params = ffi.new("appParams_t *")
        self._sample = ffi.new("appSample_t *")
        self._packet = ffi.new("uint8_t[]", lib.appHostPacketBytes())
        self.log = ffi.new("appLog_t *")  #: appLog_t after the last step
        lib.appHostDefaults(self._params)
        self._assign(params or {})
        lib.appHostInit(self._memory, self._params, have_gap8, nonce)
        if vehicle is not None:
            lib.appHostSetVehicle(self._memory, vehicle_struct(vehicle), vehicle.arm_pwm)
        lib.appHostClamp(self._params)

    def step(self, acc: Numbers, gyro: Numbers, pwm: Numbers, *,
             vbat_v: float = np.nan, attitude: Numbers = UNKNOWN, acc_in_body: bool = False) -> str:
        """One sample of 100 Hz; the kind of the edge that is reported now, "none" mostly.

        acc m/s^2 with gravity, world axes or body axes; gyro rad/s; pwm 0..65535;
        attitude: unit quaternion x, y, z, w from body to world. NaN where unknown.
        """
        sample = self._sample
        sample.acc, sample.gyro, sample.pwm = list(acc), list(gyro), list(pwm)
        sample.vbat, sample.attitude, sample.accInBody = vbat_v, list(attitude), acc_in_body
        edge = lib.appHostStep(self._memory, sample, self.log)
        return EDGES[self.log.edge] if edge else EDGES[0]

    def packets(self, accepted: bool = True) -> Iterator[bytes]:
        """The packets for the GAP8 after a step. accepted: whether the transport takes them."""
        for _ in range(PACKETS):
            length = lib.appHostOutgoing(self._memory, self._packet)
            if length == 0:
                return
            lib.appHostSent(self._memory, accepted)
            if accepted:
                yield bytes(ffi.buffer(self._packet, length))

    def receive(self, packet: bytes) -> None:
        """What came from the GAP8: any bytes."""
        lib.appHostReceive(self._memory, packet, min(len(packet), 0xFFFF))

    def params(self) -> dict[str, float]:
        """The settings in force."""
        return {name: getattr(self._params, name) for name in PARAMS}

    def set_params(self, **changes: float) -> int:
        """Change settings; those out of range are put right. Returns how many were."""
        self._assign(changes)
        return int(lib.appHostSetParams(self._memory, self._params))

    def time(self, microseconds: int, late: bool = False) -> None:
        """How long the last step took, for the log."""
        lib.appHostTime(self._memory, microseconds, late)

    def _assign(self, changes: dict[str, float]) -> None:
        for name, value in changes.items():
            if name not in PARAMS:
                raise AirTouchError(f"airtouch.{name}: no such parameter; known: {', '.join(PARAMS)}")
            most = MOST.get(PARAM_TYPES[name])
            setattr(self._params, name, float(value) if most is None else int(np.clip(value, 0, most)))


class Gap8Core:
    """The GAP8 app's core (gap8/app/src/gap8_core.h) with the networks of gap8/model."""

    def __init__(self) -> None:
        self._memory = ffi.new("double[]", lib.gap8HostBytes() // 8 + 1)
        self._packet = ffi.new("uint8_t[]", lib.appHostPacketBytes())
        self.reset()

    def reset(self) -> None:
        """As the chip does when it loses power."""
        lib.gap8HostInit(self._memory)

    def take(self, packet: bytes) -> bytes:
        """The reply to what came from the STM32: any bytes; empty for none."""
        length = lib.gap8HostTake(self._memory, packet, min(len(packet), 0xFFFF), self._packet)
        return bytes(ffi.buffer(self._packet, length))

    def heartbeat(self, uptime_ms: int) -> bytes:
        """A heartbeat; empty where nobody has spoken to it for 20 of them."""
        length = lib.gap8HostHeartbeat(self._memory, uptime_ms, self._packet)
        return bytes(ffi.buffer(self._packet, length))


#: C type of each field of appParams_t, which is the PARAM group
PARAM_TYPES = {name: field.type.cname for name, field in ffi.typeof("appParams_t").fields}
PARAMS = tuple(PARAM_TYPES)
LOGS = tuple(name for name, _ in ffi.typeof("appLog_t").fields)  #: the LOG group; feature, force, logit are arrays
