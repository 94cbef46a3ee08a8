"""Names of effects that stand for one thing in the logs at hand."""

#: names for one thing in the logs at hand, with what would tell them apart
ALIKE = (
    (frozenset({"mass", "thrust_coefficient"}),
     "add a fast climb or drop: the same thrust moves a heavier vehicle less, in proportion to its mass only "
     "where an outside force acts; weigh the vehicle, or run one motor on a scale"),
    # one push against the speed; below 0.5 m/s flapping's moment (lever 15 mm) drowns in the floor
    (frozenset({"rotor_drag", "blade_flapping"}),
     "fly at 1.5 m/s or more, with climbs and drops at speed: flapping's push grows with thrust, rotor drag "
     "with rotor speed, and only flapping pitches the vehicle, if the drag acts at the centre of mass"),
)


def names_alike(name: str) -> tuple[frozenset[str], str] | None:
    """The set of effects that these logs do not separate from this one, and what would; None without one."""
    return next(((group, advice) for group, advice in ALIKE if name in group), None)


def interchangeable(one: str, other: str) -> bool:
    """Whether two names stand for one thing in these logs."""
    group = names_alike(one)
    return one == other or (group is not None and other in group[0])
