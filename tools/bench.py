"""Prints how long kernels, detectors and networks take beside their peers, each pair in the same run.

    python tools/bench.py [--flights 20] [--train]    # 2 to 3 min without --train; `make bench` runs it too

Every pair is timed in turn (A B A B ...), after one warm-up; the ratio is the median of the pairs'.
host/docs/ablations.md has the figures.
"""

import argparse
import statistics
import time
from collections.abc import Callable, Iterable
from functools import partial
from importlib.util import find_spec

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.signal import ShortTimeFFT

from airtouch import kernels, logs
from airtouch.cli.shared.arguments import whole_number
from airtouch.cli.shared.flights import find_flights
from airtouch.cli.shared.progress import with_bar
from airtouch.detector import best, paper
from airtouch.detector.best.batches import channels_of
from airtouch.detector.best.recipe import CHANNELS, ROW_STRIDE
from airtouch.detector.evaluation.data import dataset
from airtouch.detector.paper.features import flight_features
from airtouch.detector.shared.channels import nine_channels
from airtouch.errors import AirTouchError, in_one_line
from airtouch.kernels.network import run_int8
from airtouch.logs.flight_log import FlightLog
from airtouch.parameters import DEFAULT
from airtouch.reference.networks.int8_network import quantise

SIMULATED = 8  #: flights at most, where none are recorded; chosen, for time
ALL = 1000  #: flights: more than there are
SAME = 1e-3  #: largest relative difference of two band powers that count as one; chosen
PAIRS = 7  #: alternating timings of both, of which the median ratio is reported; no source: round number


def seconds(work: Callable[[], object]) -> float:
    """Wall time of one call."""
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def compare(ours: Callable[[], object], peer: Callable[[], object]) -> tuple[float, float, float]:
    """Median seconds of ours and of the peer, and median ratio peer / ours."""
    ours(), peer()
    pairs = [(seconds(ours), seconds(peer)) for _ in range(PAIRS)]
    return (*(statistics.median(column) for column in zip(*pairs, strict=True)),
            statistics.median(b / a for a, b in pairs))


def load_flights(limit: int) -> list[FlightLog]:
    """At most `limit` recorded flights where there are any, else simulated ones, eight at most."""
    folder = find_flights()
    if folder is not None:
        return [logs.read(file.path) for file in dataset.collect([folder])[:limit]]
    from airtouch.simulation import batch

    return batch.simulate("paper-low", seeds=min(limit, SIMULATED))


def scipy_band_power(x: np.ndarray) -> np.ndarray:
    """The same band power by SciPy's short-time Fourier transform, hop 1, all bins of it: (windows, c)."""
    n = DEFAULT.band_window
    transform = ShortTimeFFT(np.hanning(n + 1)[:-1], 1, DEFAULT.sample_rate_hz, scale_to="psd", fft_mode="onesided2X")
    power = transform.spectrogram(x, axis=0, p0=n // 2, p1=len(x) - n // 2 + 1)
    chosen = (transform.f >= DEFAULT.band_low_hz) & (transform.f <= DEFAULT.band_high_hz)
    return np.moveaxis(power[chosen].sum(axis=0) * transform.delta_f, -1, 0)


def bench_band_power(table: Table, flights: list[FlightLog]) -> None:
    """FC-FE of nine channels, a flight."""
    inputs = [nine_channels(log) for log in flights]
    ours = kernels.band_power(inputs[0])[DEFAULT.band_window - 1:]
    peer = scipy_band_power(inputs[0].astype(np.float64))
    error = np.abs(ours - peer).max(axis=0) / np.abs(peer).max(axis=0)
    if error.max() > SAME:
        raise AirTouchError(f"the band power of the kernel is not SciPy's: relative error {error.max():.2g}")
    a, b, ratio = compare(lambda: [kernels.band_power(x) for x in inputs],
                          lambda: [scipy_band_power(x) for x in inputs])
    row(table, "band power, 9 channels, a flight", a / len(flights), b / len(flights), ratio,
        "scipy.signal.ShortTimeFFT", f"n = {len(flights)} flights")


def _each(act: Callable[..., object], inputs: Iterable, *further: object) -> None:
    """Call `act` with each of the inputs and the further arguments."""
    for x in inputs:
        act(x, *further)


def bench_pipelines(table: Table, flights: list[FlightLog]) -> None:
    """Whole detectors against real time."""
    duration_s = sum(len(log) for log in flights) / 100
    for name, detector in (("paper", paper), ("best", best)):
        model = detector.load(None)
        detector.run(flights[0], model)
        spent = statistics.median(seconds(partial(_each, detector.run, flights, model)) for _ in range(3))
        table.add_row(f"{name} detector, a flight", f"{1e3 * spent / len(flights):.2f} ms", "",
                      f"{duration_s / spent:.0f}x", "real time", f"n = {len(flights)} flights, {duration_s:.0f} s")


def bench_inference(table: Table, flights: list[FlightLog]) -> None:
    """int8 networks, one window: both ours against tflite-micro and LiteRT on the same file."""
    model = paper.load(None)
    fused = [flight_features(log).fused for log in flights]
    windows = np.concatenate([f[np.isfinite(f).all(axis=1)][:1000].reshape(-1, 100, 3) for f in fused])[:200]
    first = model.int8.layers[0]
    q = quantise(np.stack([kernels.z_score_window(w) for w in windows]), first.input_scale, first.input_zero_point)
    row_of_peers(table, "paper network, a window", lambda: run_int8(model.int8, q), model.tflite, q[..., None])
    stream = best.load(None)
    channels = channels_of(flights[0])[0]
    layer = stream.int8.layers[0]
    quantised = quantise(channels, layer.input_scale, layer.input_zero_point)
    length = stream.recipe.receptive_samples
    ends = np.linspace(length, len(quantised), 40).astype(int)
    cut = np.stack([quantised[e - length:e] for e in ends]).reshape(-1, 1, length, CHANNELS)
    rows = -(-len(quantised) // ROW_STRIDE)
    row_of_peers(table, "best network, a step", lambda: kernels.run_stream(stream.int8, quantised), stream.tflite, cut,
                 rows)


def row_of_peers(table: Table, name: str, ours: Callable[[], object], tflite: bytes, q: np.ndarray,
                 computed: int | None = None) -> None:
    """One row a peer; q holds one quantised input a window; ours computes `computed` of them, all if left out."""
    computed = computed or len(q)
    for peer, invoke in (("tflite-micro", micro(tflite)), ("LiteRT", litert(tflite))):
        if invoke is None:
            continue
        a, b, ratio = compare(ours, partial(_each, invoke, [x[None] for x in q]))
        row(table, name, a / computed, b / len(q), ratio * computed / len(q), peer, f"n = {computed} and {len(q)}")


def micro(content: bytes) -> Callable:
    """tflite-micro's interpreter as a function."""
    from tflite_micro.python.tflite_micro import runtime

    interpreter = runtime.Interpreter.from_bytes(content, arena_size=1 << 20)

    def invoke(x: np.ndarray) -> np.ndarray:
        """The output of one window."""
        interpreter.set_input(x, 0)
        interpreter.invoke()
        return interpreter.get_output(0)

    return invoke


def litert(content: bytes) -> Callable | None:
    """LiteRT's interpreter on one thread, None where it is not installed."""
    try:
        from ai_edge_litert.interpreter import Interpreter
    except ImportError:
        return None
    interpreter = Interpreter(model_content=content, num_threads=1)
    interpreter.allocate_tensors()
    source, result = interpreter.get_input_details()[0]["index"], interpreter.get_output_details()[0]["index"]

    def invoke(x: np.ndarray) -> np.ndarray:
        """The output of one window."""
        interpreter.set_tensor(source, x)
        interpreter.invoke()
        return interpreter.get_tensor(result)

    return invoke


def bench_training(table: Table, flights: list[FlightLog]) -> None:
    """Training of the shipped models' size, once."""
    for name, detector in (("paper", paper), ("best", best)):
        spent = seconds(partial(detector.fit, flights, seed=0))
        table.add_row(f"training {name}", f"{spent:.0f} s", "", "", "", f"n = {len(flights)} flights")


def row(table: Table, name: str, ours: float, peer: float, ratio: float, what: str, note: str) -> None:
    """One comparison."""
    table.add_row(name, f"{1e6 * ours:.1f} us", f"{1e6 * peer:.1f} us", f"{ratio:.3g}x", what, note)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flights", type=whole_number(1), default=20, help="how many at most (default %(default)s)")
    parser.add_argument("--train", action="store_true", help="time the training on all of them as well")
    options = parser.parse_args()
    if find_spec("tflite_micro") is None:
        parser.error("tflite-micro is not installed: pip install '.[test]'")
    flights = load_flights(options.flights)
    table = Table(title=f"Benchmarks, median of {PAIRS} pairs, one thread", title_justify="left")
    for name in ("what", "ours", "peer", "faster", "peer is", ""):
        table.add_column(name)
    benches = [(bench_band_power, flights), (bench_pipelines, flights), (bench_inference, flights)]
    if options.train:
        benches.append((bench_training, load_flights(ALL)))
    for bench, recorded in with_bar(benches, "benchmarks"):
        bench(table, recorded)
    Console(width=130).print(table)


if __name__ == "__main__":
    with in_one_line("bench"):
        main()
