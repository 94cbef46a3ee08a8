"""`airtouch map`: the edges of a flight in the plane."""

import json
from pathlib import Path

import click

from airtouch import logs
from airtouch.cli.shared.options import SPEED_MPS, Finite
from airtouch.detector.evaluation.data import dataset
from airtouch.errors import AirTouchError
from airtouch.extras import need
from airtouch.logs.files import check_free, write_bytes
from airtouch.logs.formats.rosbag import is_bag


@click.command(name="map")
@click.argument("flight", type=click.Path(path_type=Path))
@click.option("--detector", default="best", show_default=True, help="Detector that finds the edges.")
@click.option("--model", type=click.Path(path_type=Path), help="Trained model (.npz); the shipped one if left out.")
@click.option("--truth", is_flag=True, help="Map the true edges of the down range instead of the detector's.")
@click.option("--speed", type=SPEED_MPS, metavar="M/S",
              help="Commanded speed, before that of the manifest or the log: for dead reckoning where the log has no "
                   "position.")
@click.option("--heading", type=Finite(), default=0.0, metavar="DEG", help="Heading of that dead reckoning.")
@click.option("--sigma", type=Finite(0, 5, min_open=True), metavar="S",
              help="Timing error of a detection; that of the model, or 0.1 s, if left out.")
@click.option("--out", type=click.Path(path_type=Path),
              help="GeoJSON to write, of any ending; the plot goes beside it as .png. Or the plot, as .png, .svg or "
                   ".pdf; the GeoJSON goes beside it.")
@click.option("--force", is_flag=True, help="Replace both.")
def command(flight: Path, detector: str, model: Path | None, truth: bool, speed: float | None, heading: float,
            sigma: float | None, out: Path | None, force: bool) -> None:
    """Map the edges of FLIGHT: points, and for a zig-zag the outlines of the platforms below.

    \b
    airtouch map flights/airtouch/imu_data_0126-1906.csv.gz
    airtouch map zigzag.csv --out map.geojson

    Positions come from x_m, y_m where they hold values; else from the commanded speed, which places edges
    along the track only. Each edge has a 1-sigma: the detector's timing error times the speed there.
    """
    need("map", "a map")
    from airtouch.detector.evaluation import edge_map
    from airtouch.detector.evaluation.evaluate import remarks
    from airtouch.report.style import FORMATS

    out = out or Path(flight.name.removesuffix(".gz")).with_suffix(".geojson")
    picture = out if out.suffix.lower().removeprefix(".") in FORMATS else out.with_suffix(".png")
    out = out.with_suffix(".geojson") if out == picture else out
    for path in (out, picture):
        check_free(path, force)
    if flight.is_dir() and not is_bag(flight):
        raise AirTouchError(f"{flight}: a folder; a map is of one flight, name its log")
    (file,) = dataset.collect([flight], speed)
    log = logs.read(flight)
    for line in remarks(log):
        click.echo(f"airtouch: {flight}: {line}", err=True)
    speed = speed or dataset.with_flown_speed(file, log).condition.speed_mps
    edge_map.track(log, speed)  # raises if both are missing, before the detector runs
    source = edge_map.true_edges_of(log) if truth else edge_map.detected_edges(log, detector, model)
    plane = edge_map.edge_map(log, source.edges, lag_s=source.lag_s, sigma_s=sigma or source.sigma_s,
                              speed_mps=speed, heading_deg=heading)
    content = edge_map.geojson(plane.points, plane.platforms, {
        "flight": flight.name, "detector": "truth" if truth else detector, "position": plane.position,
        "lag_s": plane.lag_s, "sigma_s": plane.sigma_s, "edges_without_position": plane.without_position})
    from airtouch.report import map_figure
    from airtouch.report.style import write_image

    write_bytes((json.dumps(content, allow_nan=False) + "\n").encode(), out, force)
    title = f"{flight.name}: {len(plane.points)} edges ({plane.position})"
    write_image(map_figure.edge_map(plane, title), picture, force)
    for point in plane.points:
        click.echo(f"{point.kind:5} at {point.time_s:6.2f} s: x {point.x_m:+.3f} m, y {point.y_m:+.3f} m, "
                   f"1-sigma {point.sigma_m:.3f} m")
    if plane.without_position:
        click.echo(f"left out: {plane.without_position} of {len(source.edges)} edges, at which the log has no position "
                   "(x_m, y_m), and the passes that they begin or end")
    if not source.edges:
        click.echo("no edges found" + (" in the down range" if truth else f" by {detector}"))
    for number, platform in enumerate(plane.platforms):
        if platform.outline is not None:
            click.echo(f"platform {number}: {platform.outline.area:.3f} m^2, outline 1-sigma {platform.sigma_m:.3f} m")
    click.echo(f"written: {out}, {picture}")
