"""The AirTouch app on board: the C core of the STM32 app, the C core of the GAP8 app, and the link between them.

LOG and PARAM groups have the names and types of firmware/app/src/airtouch_app.c.
"""

from collections.abc import Sequence

from airtouch.kernels.app_core import PARAM_TYPES, AppCore, Gap8Core
from airtouch.sitl.services.param_service import Parameter
from airtouch.vehicle import Vehicle

GROUP = "airtouch"
HEARTBEAT_S = 0.5
BOOT_S = 1.5  #: s that the GAP8 needs to boot
#: log variable -> (type, field of appLog_t, element)
LOGS: dict[str, tuple[str, str, int]] = {
    "fAcc": ("float", "feature", 0), "fGyro": ("float", "feature", 1), "fMotor": ("float", "feature", 2),
    "fwx": ("float", "force", 0), "fwy": ("float", "force", 1), "fwz": ("float", "force", 2),
    "cell": ("float", "cfarPower", -1), "thresh": ("float", "threshold", -1),
    "alert": ("uint8_t", "alert", -1),
    "prob": ("float", "probability", -1), "lOver": ("float", "logit", 0), "lEntry": ("float", "logit", 1),
    "lExit": ("float", "logit", 2), "edges": ("uint16_t", "edges", -1), "edge": ("uint8_t", "edge", -1),
    "edgeStep": ("uint32_t", "edgeSample", -1), "over": ("uint8_t", "over", -1),
    "steps": ("uint32_t", "samples", -1), "health": ("uint16_t", "health", -1),
    "load": ("uint16_t", "load", -1),
    "loadMax": ("uint16_t", "loadMax", -1), "late": ("uint16_t", "late", -1),
    "detector": ("uint8_t", "detector", -1), "link": ("uint8_t", "link", -1), "lag": ("uint16_t", "lag", -1),
    "answers": ("uint32_t", "answers", -1), "dropped": ("uint32_t", "dropped", -1),
    "lost": ("uint32_t", "lost", -1), "timeouts": ("uint32_t", "timeouts", -1),
    "resets": ("uint32_t", "gap8Resets", -1), "gap8Up": ("uint32_t", "gap8Uptime", -1),
    "nonFin": ("uint32_t", "nonFinite", -1), "badParam": ("uint16_t", "paramErrors", -1),
}
#: parameter -> field of appParams_t
PARAMS = {
    "enable": "enable", "detector": "detector", "filter": "filter", "bandMid": "bandMid",
    "bandWidth": "bandWidth", "pFa": "pFa", "probIn": "probabilityIn", "probOut": "probabilityOut",
    "scoreIn": "scoreIn", "scoreOut": "scoreOut", "probDwell": "probabilityDwell", "alertHold": "alertHold",
}


class App:
    """The app. `step` takes one sample at 100 Hz; `read` returns a log variable."""

    def __init__(self, have_gap8: bool, vehicle: Vehicle | None = None) -> None:
        """vehicle: the one that the app is built for; AppCore's default if left out."""
        self._core = AppCore(have_gap8=have_gap8, vehicle=vehicle)
        self._gap8 = Gap8Core() if have_gap8 else None
        self._booted_s = self._beat_s = 0.0
        self.gap8_silent = False
        self.sent = 0  #: packets to the GAP8 so far; 0 if the parameter `detector` does not use it

    def parameters(self) -> list[Parameter]:
        """The PARAM group with its present values."""
        values = self._core.params()
        return [Parameter(f"{GROUP}.{name}", PARAM_TYPES[field], values[field])
                for name, field in PARAMS.items()]

    def set(self, name: str, value: float) -> float:
        """Set a parameter. Returns its value, which differs from `value` if that was out of range."""
        self._core.set_params(**{PARAMS[name]: value})
        return self._core.params()[PARAMS[name]]

    def values(self) -> dict[str, float]:
        """The present values of all parameters; setting one may change another."""
        in_force = self._core.params()
        return {f"{GROUP}.{name}": in_force[field] for name, field in PARAMS.items()}

    def read(self, name: str) -> float:
        """The value of a log variable."""
        _, field, element = LOGS[name]
        value = getattr(self._core.log, field)
        return value if element < 0 else value[element]

    def reset_gap8(self, now_s: float) -> None:
        """Power-cycle the GAP8."""
        if self._gap8:
            self._gap8.reset()
            self._booted_s = self._beat_s = now_s + BOOT_S

    def step(self, now_s: float, acc_world: Sequence[float], gyro: Sequence[float], pwm: Sequence[float],
             vbat_v: float, attitude: Sequence[float]) -> str:
        """Process one sample: world acceleration (3,) in m/s^2 with gravity, gyro (3,) in rad/s, PWM (4,), V, and
        attitude as a quaternion x, y, z, w.

        Returns the kind of the edge reported at this sample; "none" without one.
        """
        edge = self._core.step(acc_world, gyro, pwm, vbat_v=vbat_v, attitude=attitude)
        gap8 = None if self.gap8_silent or now_s < self._booted_s else self._gap8  # None: no answer
        for sent in self._core.packets():
            self.sent += 1
            reply = gap8.take(sent) if gap8 else b""
            if reply:
                self._core.receive(reply)
        if gap8 and now_s >= self._beat_s:
            self._beat_s = now_s + HEARTBEAT_S
            beat = gap8.heartbeat(int(1000 * (now_s - self._booted_s)))
            if beat:
                self._core.receive(beat)
        return edge
