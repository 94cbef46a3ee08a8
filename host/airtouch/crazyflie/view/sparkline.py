"""Signals and maps as text, drawn with block characters in a terminal."""

from collections.abc import Sequence

import numpy as np

BLOCKS = "▁▂▃▄▅▆▇█"
EMPTY = " "


def sparkline(values: Sequence[float], width: int, low: float | None = None,
              high: float | None = None) -> str:
    """Values (n,) as `width` block characters, each the mean of n / width values; a space if none is finite.

    low, high: ends of the scale; the least and greatest value if left out. A constant signal is at the bottom.
    """
    v = np.asarray(values, dtype=np.float64)
    if width < 1 or not len(v):
        return EMPTY * max(width, 0)
    bounds = np.linspace(0, len(v), min(width, len(v)) + 1).astype(int)
    finite = np.isfinite(v)
    sums = np.add.reduceat(np.where(finite, v, 0.0), bounds[:-1])
    counts = np.add.reduceat(finite.astype(int), bounds[:-1])
    means = np.where(counts > 0, sums / np.maximum(counts, 1), np.nan)
    finite_means = means[np.isfinite(means)]
    if not len(finite_means):
        return EMPTY * width
    low = finite_means.min() if low is None else low
    high = finite_means.max() if high is None else high
    share = np.clip((means - low) / (high - low), 0.0, 1.0) if high > low else means * 0.0
    text = "".join(EMPTY if not np.isfinite(s) else BLOCKS[int(round(s * (len(BLOCKS) - 1)))] for s in share)
    return text.rjust(width)


def text_map(track: np.ndarray, edges: Sequence[tuple[float, float, str]], width: int = 40,
             height: int = 12) -> list[str]:
    """A map from above as lines of text, x to the right, y up.

    Track ".", entries "[", exits "]", other edges "|", drone "o".
    track: (n, 2), m. edges: (x, y, kind). A character is taken to be twice as high as wide.
    """
    known = track[np.isfinite(track).all(axis=1)] if len(track) else np.empty((0, 2))
    places = np.vstack([known, np.array([(x, y) for x, y, _ in edges]).reshape(-1, 2)])
    places = places[np.isfinite(places).all(axis=1)]
    if not len(places):
        return ["no position"] + [""] * (height - 1)
    middle = (places.min(axis=0) + places.max(axis=0)) / 2.0
    spread = np.maximum(np.ptp(places, axis=0), 0.2)
    metre_a_row = max(spread[0] / ((width - 1) / 2.0), spread[1] / (height - 1))
    grid = [[EMPTY] * width for _ in range(height)]

    def put(x: float, y: float, sign: str) -> None:
        if not np.isfinite([x, y]).all():
            return
        column = int(round((x - middle[0]) / metre_a_row * 2.0 + (width - 1) / 2.0))
        row = int(round((middle[1] - y) / metre_a_row + (height - 1) / 2.0))
        if 0 <= row < height and 0 <= column < width:
            grid[row][column] = sign

    for x, y in known[::max(len(known) // (4 * width), 1)]:
        put(x, y, ".")
    for x, y, kind in edges:
        put(x, y, {"entry": "[", "exit": "]"}.get(kind, "|"))
    if len(known):
        x, y = known[-1]
        put(x, y, "o")
    lines = ["".join(row) for row in grid]
    scale = f"{metre_a_row * 10:.2f} m"
    room = max(width - 22 - len(scale), 0)
    lines[-1] = f"{lines[-1][:room]:{room}} |<- 20 columns = {scale}"
    return lines
