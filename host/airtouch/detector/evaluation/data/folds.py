"""Which flights are held out together: the manifest's folds, whole days, or one group."""

from collections.abc import Sequence

from airtouch.detector.evaluation.data.dataset import FlightFile
from airtouch.errors import AirTouchError

Folds = dict[int, list[FlightFile]]
GROUPS_OF_DAYS = 5  #: as many as the manifest has folds
#: folds of the authors' flights on which settings are chosen; each look at the others is in host/docs/looks.md
BUILD_FOLDS = (0, 1, 2)
BUILD_DAYS = ("19", "20")  #: neural-swarm's days on which settings are chosen, as its manifest names them


def in_folds(files: Sequence[FlightFile], folds: Sequence[int]) -> list[FlightFile]:
    """The flights of these folds of the manifest, all without any. Raises AirTouchError for folds without a flight."""
    chosen = [file for file in files if not folds or file.condition.fold in folds]
    if not chosen and folds:
        known = sorted({file.condition.fold for file in files if file.condition.fold is not None})
        there = f"its folds are {', '.join(map(str, known))}" if known else "it has no folds"
        raise AirTouchError(f"no flight is in fold {', '.join(map(str, folds))} of the manifest; {there}")
    return chosen


def by_fold(files: Sequence[FlightFile]) -> Folds:
    """Fold -> its flights. Raises AirTouchError for flights without a fold or with fewer than two folds."""
    folds: Folds = {}
    for file in files:
        if file.condition.fold is None:
            raise AirTouchError(f"{file.path}: no fold in the manifest beside it; "
                                "add a column 'fold' (0, 1, ...)")
        folds.setdefault(file.condition.fold, []).append(file)
    if len(folds) < 2:
        raise AirTouchError("cross-validation needs at least two folds; the manifest's column 'fold' has "
                            f"{len(folds)}")
    return dict(sorted(folds.items()))


def by_day(files: Sequence[FlightFile]) -> Folds:
    """Whole days, in up to five groups: the largest day first, each into the smallest group.

    Raises AirTouchError for flights without a day and with fewer than two days.
    """
    days: dict[str, list[FlightFile]] = {}
    for file in files:
        if file.condition.day is None:
            raise AirTouchError(f"{file.path}: its day is not known; add a column 'day' to the manifest beside it")
        days.setdefault(file.condition.day, []).append(file)
    if len(days) < 2:
        raise AirTouchError(f"cross-validation by day needs flights of at least two days, not {len(days)}")
    groups: list[list[FlightFile]] = [[] for _ in range(min(GROUPS_OF_DAYS, len(days)))]
    for day in sorted(days, key=lambda name: (-len(days[name]), name)):
        min(groups, key=len).extend(days[day])
    return dict(enumerate(groups))


def still_air(files: Sequence[FlightFile]) -> dict[tuple[str, str, str], list[FlightFile]]:
    """(Day, class of height, angle in degrees) -> the flights in still air that were flown so; "None" where unknown."""
    groups: dict[tuple[str, str, str], list[FlightFile]] = {}
    for file in files:
        flown = file.condition
        if flown.wind == "none":
            angle = "None" if flown.angle_deg is None else f"{flown.angle_deg:g}"
            groups.setdefault((f"{flown.day}", f"{flown.height}", angle), []).append(file)
    return groups


def only(files: Sequence[FlightFile], group: str) -> Folds:
    """One fold: the flights of a folder or day of this name, to be scored by a model of all others.

    Raises AirTouchError where no flight, or every flight, is in it.
    """
    members = [file for file in files if group in (file.path.resolve().parent.name, file.condition.day)]
    if not members or len(members) == len(files):
        raise AirTouchError(f"{group}: {len(members)} of {len(files)} flights are of this folder or day; "
                            "some must be, and others not")
    return {0: members}
