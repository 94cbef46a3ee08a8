"""The sizes of the network, and its weights, which `python -m airtouch.vision.training` made."""

import hashlib
import zipfile
import zlib
from importlib import resources

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.vision import teed

SIZES = {"teed": teed.WIDTHS, "half": (8, 16, 24), "quarter": (4, 8, 12), "eighth": (2, 4, 6)}  #: name -> widths


def load(name: str) -> tuple[teed.Weights, float]:
    """(weights, seconds that their training took) of a size that comes with the package.

    Raises AirTouchError where the file is missing or damaged.
    """
    path = str(resources.files("airtouch.vision") / f"{name}.npz")
    try:
        with np.load(path) as file:
            return {key: file[key].astype(np.float32) for key in file.files if key != "seconds"}, float(file["seconds"])
    except (OSError, EOFError, ValueError, KeyError, zipfile.BadZipFile, zlib.error) as error:
        raise AirTouchError(f"{path}: {error}; make it with python -m airtouch.vision.training") from None


def digest(settings: str) -> str:
    """Twelve hexadecimal digits that change with any of the weights, with the camera's code and with the settings."""
    total = hashlib.sha256(settings.encode())
    for module in sorted(resources.files("airtouch.vision").iterdir(), key=lambda file: file.name):
        if module.name.endswith(".py"):
            total.update(module.read_bytes())
    for name in SIZES:
        for key, values in sorted(load(name)[0].items()):
            total.update(key.encode() + values.tobytes())
    return total.hexdigest()[:12]
