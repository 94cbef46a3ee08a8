"""Models and scores in files: an adaptation that was stopped goes on with what it has finished."""

import hashlib
import json
from collections.abc import Callable
from pathlib import Path

from airtouch import __version__
from airtouch.detector import best
from airtouch.detector.best.model import BestModel
from airtouch.detector.evaluation.score import FlightScore
from airtouch.errors import AirTouchError
from airtouch.logs.files import read_text, write_bytes
from airtouch.simulation.firmware import settings
from airtouch.vehicle import Vehicle


def equations(vehicle: Vehicle) -> str:
    """The version of AirTouch, and a hash of the settings of the firmware that the vehicle flies.

    For the keys of stored results: `Vehicle.firmware` is a name or a path, and a file may have changed.
    """
    return f"{__version__} {hashlib.sha256(settings.load(vehicle.firmware).tobytes()).hexdigest()}"


def model(path: Path, make: Callable[[], BestModel]) -> BestModel:
    """The model in a file (.npz); without the file it is made and saved there.

    Raises AirTouchError for a file that is no model.
    """
    if path.is_file():
        return best.load(path)
    new = make()
    new.save(path, force=True)
    return new


def scores(path: Path, make: Callable[[], list[FlightScore]]) -> list[FlightScore]:
    """The scores in a file (JSON); without the file they are made and saved there.

    Raises AirTouchError for a file that holds none.
    """
    if path.is_file():
        try:
            return [FlightScore.from_dict(s) for s in json.loads(read_text(path))]
        except (ValueError, TypeError, KeyError, AttributeError):
            raise AirTouchError(f"{path}: no scores of flights; remove the file, and they are made anew") from None
    new = make()
    write_bytes(json.dumps([s.as_dict() for s in new], allow_nan=False).encode(), path, force=True)
    return new
