"""From a probability to edges, as the C pipeline does it, for flights whose force is known already."""

import numpy as np

from airtouch.detector.trace import Detection
from airtouch.parameters import DEFAULT, Parameters
from airtouch.reference.edge_pipeline import ENTRY, EXIT, NONE


def decode(
    probability: np.ndarray,
    armed: np.ndarray,
    alert: np.ndarray | None = None,
    parameters: Parameters = DEFAULT,
) -> list[Detection]:
    """Edges of one flight, causal, each at the sample at which it is declared.

    probability: (n,) P(over a platform), NaN for none. armed: (n,) bool, long enough in the
    air. Hysteresis as `reference.edge_pipeline.decode`: entry from `probability_entry` up, exit
    from `probability_exit` down, `dwell_samples` apart. alert: (n,) bool of FR-CFAR: edges
    without one in the last `alert_hold` samples are dropped (the paper's physical filter);
    None switches that off. A dropped edge still changes the state.
    """
    edges = detections(edge_codes(probability, armed, parameters), probability)
    return edges if alert is None else physical_filter(edges, alert, parameters.alert_hold)


def edge_codes(probability: np.ndarray, armed: np.ndarray, parameters: Parameters = DEFAULT) -> np.ndarray:
    """Edges (n,), NONE, ENTRY or EXIT: `reference.edge_pipeline.decode`, from crossing to crossing.

    Tuning decodes each flight with hundreds of settings; one step a sample in Python took most of a training's time.
    A test holds the two equal.
    """
    probability, armed = np.asarray(probability, float), np.asarray(armed, bool)
    edge = np.full(len(probability), NONE)
    usable = armed & np.isfinite(probability)
    levels = {False: np.flatnonzero(usable & (probability >= parameters.probability_entry)),
              True: np.flatnonzero(usable & (probability <= parameters.probability_exit))}
    bounds = np.flatnonzero(np.diff(np.concatenate([[False], armed, [False]]).astype(int)))
    for first, end in bounds.reshape(-1, 2).tolist():
        over, sample = False, first
        while True:
            place = int(np.searchsorted(levels[over], sample))
            if place == len(levels[over]) or levels[over][place] >= end:
                break
            crossing = int(levels[over][place])
            over = not over
            edge[crossing] = ENTRY if over else EXIT
            sample = crossing + max(parameters.dwell_samples, 1)
    return edge


def detections(edge: np.ndarray, probability: np.ndarray) -> list[Detection]:
    """Edge codes (n,) of the pipeline, C or reference, as detections."""
    edges = []
    for sample in np.flatnonzero(edge != NONE):
        entry = edge[sample] == ENTRY
        p = float(probability[sample])
        edges.append(Detection(int(sample), "entry" if entry else "exit", p if entry else 1.0 - p))
    return edges


def physical_filter(edges: list[Detection], alert: np.ndarray, hold: int) -> list[Detection]:
    """The edges with an FR-CFAR alert among the `hold` samples that end with theirs (paper, section 5.1)."""
    alerts = np.concatenate([[0], np.cumsum(alert)])
    return [e for e in edges if alerts[e.sample + 1] > alerts[max(e.sample + 1 - hold, 0)]]
