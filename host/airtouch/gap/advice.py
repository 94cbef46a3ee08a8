"""What to fly or log next: the manoeuvre or channel that would settle what these logs leave open."""

from collections.abc import Sequence

from airtouch.gap import candidates
from airtouch.gap.flight import Flight
from airtouch.gap.result import Cell

#: what separates pairs that logs like these confuse
SEPARATES = {
    frozenset({"motor_lag", "actuator_delay"}): "command steps in hover at two step sizes, or log rpm: a lag "
    "rounds the response, a delay shifts it",
    frozenset({"motor_lag", "inertia"}): "log rpm, or add quick yaw turns: inertia scales every response alike",
    frozenset({"wind", "imu_bias"}): "stand still with motors off for five seconds, and turn the vehicle by 90 "
    "degrees in hover: wind turns in body axes and is gone on the ground, a bias is neither",
    frozenset({"weak_motor", "com_offset"}): "add yaw turns: a weak rotor leaves yaw torque, an offset does not",
    frozenset({"rotor_drag", "blade_flapping"}): "fly faster than 1 m/s: flapping tilts the vehicle as well",
    frozenset({"sensor_latency", "controller_gain"}): "log the attitude set-points, or fly steps of attitude",
    frozenset({"battery_sag", "thrust_coefficient"}): "log the battery voltage over a whole flight",
}


def advice(verdict: str, effects: Sequence[str], alike: Sequence[tuple[str, ...]], cells: Sequence[Cell],
           flights: Sequence[Flight], baseline: bool) -> str:
    """One to three sentences."""
    said = []
    for group in alike:
        pair = frozenset(group)
        twins = candidates.twins_of(group[0])
        tell = next((t for k, t in SEPARATES.items() if k <= pair), None)
        if twins and twins[0] <= pair:
            said.append(f"To tell {' from '.join(sorted(twins[0]))}: {twins[1]}.")
        elif tell:
            said.append(f"To tell {' from '.join(group)}: {tell}.")
        else:
            said.append(f"To tell {' from '.join(group)}: repeat the flight with other speeds and heights.")
    if verdict == "unknown" and cells:
        c = cells[0]
        said.append(f"What is left lies {_where(c)}: repeat the flight with more {c.phase} and add the effect that "
                    "you suspect in a file of your own (docs: add an effect).")
    if verdict == "effect" and not said:
        said.append(f"Switch on {' and '.join(effects)} with these parameters in the simulator, and fly it again.")
    if verdict == "none":
        said.append("Nothing to add; longer flights would lower the floor.")
    if not baseline:
        said.append("Give flights that are known to be nominal with --baseline: they lower the floor and show delays "
                    "and gains of the controller.")
    missing = {c.split(":")[0] for f in flights for c in f.cannot}
    if "no gyro" in missing:
        said.append("Log the gyro: it shows torque at every frequency.")
    return " ".join(said)


def _where(cell: Cell) -> str:
    return f"in {cell.channel.replace('_', ' ')} at {cell.band_hz[0]:g} to {cell.band_hz[1]:g} Hz, {cell.phase}"
