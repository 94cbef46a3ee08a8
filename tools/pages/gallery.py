"""Draws the pictures of the gallery page (host/docs/gallery.md), from simulated flights and from reports that exist.

    airtouch gap demo; airtouch demo --force; python tools/pages/gallery.py

The three take four minutes, the last of them under one. Flights are simulated with fixed seeds. Reports are
photographed in Chromium at 1,280 and 390 pixels; without a browser or a report those pictures stay as they are, and the
tool says so.
"""

import argparse
import io
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from PIL import Image

import airtouch as at
from airtouch import logs
from airtouch.crazyflie import mission
from airtouch.detector import baseline, best, paper
from airtouch.detector.evaluation import edge_map
from airtouch.detector.evaluation.data.dataset import Condition, FlightFile
from airtouch.detector.evaluation.evaluate import evaluate_flight
from airtouch.detector.evaluation.score_report import hit_curve
from airtouch.errors import in_one_line
from airtouch.logs.files import make_folder, write_bytes
from airtouch.report import evaluation_figures, map_figure
from airtouch.report.style import image

COLOURS = 96  #: of a picture's palette, so that it is a third of its size
#: names of Chromium's programs
BROWSERS = ("chromium", "chromium-browser", "google-chrome")


def main() -> int:
    """Write the pictures; 1 where some could not be made."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--gap", type=Path, default=Path("out/gap-demo/report.html"),
                        help="what `airtouch gap demo` wrote")
    parser.add_argument("--demo", type=Path, default=Path("out/demo/report.html"), help="what `airtouch demo` wrote")
    parser.add_argument("--out", type=Path, default=Path("host/docs/img"), help="folder")
    options = parser.parse_args()
    make_folder(options.out)
    pictures: dict[str, Callable[[], bytes]] = {
        "virtual-flight": virtual_flight, "zig-zag-map": zig_zag_map, "virtual-errors": virtual_errors}
    lacking = []
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    for name, page, width, height in (("gap-report", options.gap, 1280, 1250),
                                      ("gap-report-phone", options.gap, 390, 1000),
                                      ("demo-report", options.demo, 1280, 1000)):
        if browser and page.exists():
            pictures[name] = partial(photograph, browser, page, width, height)
        else:
            lacking.append(f"{name}.png: {'no ' + page.as_posix() if browser else 'no Chromium'}")
    for name, draw in pictures.items():
        small = smaller(draw())
        write_bytes(small, options.out / f"{name}.png", force=True)
        print(f"{options.out / name}.png: {len(small) / 1000:.0f} kB", flush=True)
    for line in lacking:
        print(f"not made: {line}", file=sys.stderr)
    return 1 if lacking else 0


def virtual_flight() -> bytes:
    """PNG of one flight of the mission sweep: signals, probability, edges, down range."""
    (log,) = at.simulate(mission.scene_of("sweep"), seed=1)
    trace = best.run(log)
    return image(evaluation_figures.flight(log, trace, logs.true_edges(log), name="best"))


def zig_zag_map() -> bytes:
    """PNG of the map of one zig-zag over a table."""
    (log,) = at.simulate(mission.scene_of("zig-zag"), seed=1)
    model = best.load(None)
    edges = best.run(log, model).edges
    edge_points = edge_map.edge_map(log, edges, lag_s=best.lag_s(model),
                                    sigma_s=model.metadata.get("sigma_s", edge_map.ASSUMED_SIGMA_S))
    return image(map_figure.edge_map(edge_points, f"zig-zag: {len(edge_points.points)} edges detected"))


def virtual_errors(count: int = 20) -> bytes:
    """PNG: fraction of edges detected within a distance, three detectors, `count` flights of paper-low."""
    flights = at.simulate("paper-low", count, seed=1)
    scores = {}
    for name, module in (("best", best), ("paper", paper), ("baseline", baseline)):
        model = module.load(None)
        scores[name] = [evaluate_flight(FlightFile(Path(log.source),
                                                   Condition(speed_mps=log.meta["condition"]["speed"])),
                                        log, module, model).score for log in flights]
    return image(evaluation_figures.error_distribution({name: hit_curve(own) for name, own in scores.items()}))


def photograph(browser: str, page: Path, width: int, height: int) -> bytes:
    """PNG of a page's first `height` pixels in a window `width` wide.

    Chromium's own window is never narrower than 500 pixels, so the page is shown in a frame.
    """
    with tempfile.TemporaryDirectory() as folder:
        frame, shot = Path(folder) / "frame.html", Path(folder) / "shot.png"
        frame.write_text(f"<body style='margin:0'><iframe src='{page.resolve().as_uri()}' scrolling='no' "
                         f"style='border:0;width:{width}px;height:{height}px'></iframe></body>", "utf-8")
        subprocess.run([browser, "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars",
                        "--allow-file-access-from-files", f"--window-size={max(width, 500)},{height}",
                        f"--screenshot={shot}", frame.as_uri()], check=True, capture_output=True, timeout=120)
        picture = np.asarray(Image.open(shot).convert("RGB"))[:height, :width]
    out = io.BytesIO()
    Image.fromarray(picture).save(out, "png")
    return out.getvalue()


def smaller(picture: bytes) -> bytes:
    """The PNG with a palette."""
    out = io.BytesIO()
    Image.open(io.BytesIO(picture)).convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE).save(
        out, "png", optimize=True)
    return out.getvalue()


if __name__ == "__main__":
    with in_one_line("gallery"):
        sys.exit(main())
