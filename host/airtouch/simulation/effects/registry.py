"""The registry: every effect by its name, in the order in which they are applied."""

import importlib
from collections.abc import Iterable, Mapping

from airtouch.errors import AirTouchError, unknown
from airtouch.simulation.effects.effect import Active, Effect

#: Effects in the order in which they are applied, and the folder of each one's file
FOLDER_OF = {
    "ground_effect": "air", "rotor_drag": "air", "wind": "air", "gust": "air", "blade_flapping": "air",
    "motor_lag": "motors", "motor_noise": "motors", "thrust_coefficient": "motors", "weak_motor": "motors",
    "battery_sag": "motors",
    "mass": "body", "com_offset": "body", "inertia": "body", "slung_load": "body",
    "imu_bias": "sensing", "imu_noise": "sensing", "vibration": "sensing", "sensor_latency": "sensing",
    "actuator_delay": "motors",
    "time_jitter": "logging", "packet_loss": "logging",
    "range_step": "sensing", "range_bias": "sensing", "flow_scale": "sensing", "flow_latency": "sensing",
    "controller_gain": "sensing",
    "downwash": "air",
}
NAMES = tuple(FOLDER_OF)
EFFECTS: dict[str, Effect] = {
    name: importlib.import_module(f"airtouch.simulation.effects.{folder}.{name}").EFFECT
    for name, folder in FOLDER_OF.items()}
LOADED: dict[int, list[Effect]] = {}  #: effects of a user's own by the hash of their text
SOURCE: dict[str, str] = {}  #: file of each of them, by name


def register(effect: Effect) -> Effect:
    """Add an effect of your own; raises AirTouchError when its name is taken."""
    if effect.name in EFFECTS:
        raise AirTouchError(f"an effect named {effect.name!r} is already there")
    EFFECTS[effect.name] = effect
    return effect


def unregister(name: str) -> None:
    """Take an effect out (the diagnosis is tested on effects that it does not know)."""
    get(name)
    del EFFECTS[name]
    SOURCE.pop(name, None)
    for key in [k for k, loaded in LOADED.items() if any(e.name == name for e in loaded)]:
        del LOADED[key]


def get(name: str) -> Effect:
    """The effect of that name; AirTouchError names the known ones."""
    if name not in EFFECTS:
        raise unknown("effect", name, EFFECTS)
    return EFFECTS[name]


def activate(chosen: Iterable[Active | tuple[str, Mapping[str, float]]] | Mapping[str, Mapping[str, float]],
             ) -> list[Active]:
    """Effects with all their values, in the registry's order (so that the order given does not matter).

    chosen: {name: {parameter: value}}, or pairs of both where one effect comes twice.
    Raises AirTouchError for unknown names, values out of bounds, and a second one of an effect that can be on once.
    """
    if isinstance(chosen, Mapping):
        chosen = list(chosen.items())
    active = []
    for item in chosen:
        if not isinstance(item, Active):
            effect = get(item[0])
            item = Active(effect, effect.values(item[1]))
        if item.effect.once and any(a.effect.name == item.effect.name for a in active):
            raise AirTouchError(f"{item.effect.name} is given twice; a second one would only replace the first")
        active.append(item)
    order = {name: i for i, name in enumerate(EFFECTS)}
    return sorted(active, key=lambda a: order.get(a.effect.name, len(order)))
