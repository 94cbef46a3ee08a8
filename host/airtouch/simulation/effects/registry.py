"""The registry: every effect by its name, in the order in which they are applied."""

import importlib
from collections.abc import Iterable, Mapping, Sequence

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
    if not isinstance(name, str):
        raise AirTouchError(f"an effect is given by its name, not {name!r}")
    if name not in EFFECTS:
        raise unknown("effect", name, EFFECTS)
    return EFFECTS[name]


def names_of(without: Iterable[str]) -> tuple[str, ...]:
    """The names of effects, each a known one. Raises AirTouchError for another, and for a name in place of a list."""
    if isinstance(without, str):
        raise AirTouchError(f"without is a list of effects: [{without!r}]")
    if not isinstance(without, Iterable):
        raise AirTouchError(f"without is a list of effects, not {without!r}")
    return tuple(get(name).name for name in without)


def activate(chosen: Iterable[Active | tuple[str, Mapping[str, float]]] | Mapping[str, Mapping[str, float]],
             ) -> list[Active]:
    """Effects with all their values, in the registry's order (so that the order given does not matter).

    chosen: {name: {parameter: value}}, or pairs of both where one effect comes twice.
    Raises AirTouchError for unknown names, values out of bounds, and a second one of an effect that can be on once.
    """
    if isinstance(chosen, str) or not isinstance(chosen, Iterable):
        raise AirTouchError(f"effects are {{name: {{parameter: value}}}}, or pairs of both, not {chosen!r}")
    if isinstance(chosen, Mapping):
        chosen = list(chosen.items())
    active = []
    for item in chosen:
        if not isinstance(item, Active):
            if not (isinstance(item, Sequence) and len(item) == 2 and isinstance(item[1], Mapping)):
                raise AirTouchError(f"an effect is a pair of its name and {{parameter: value}}, not {item!r}")
            effect = get(item[0])
            item = Active(effect, effect.values(item[1]))
        if item.effect.once and any(a.effect.name == item.effect.name for a in active):
            raise AirTouchError(f"{item.effect.name} is given twice; a second one would only replace the first")
        active.append(item)
    order = {name: i for i, name in enumerate(EFFECTS)}
    return sorted(active, key=lambda a: order.get(a.effect.name, len(order)))
