"""From a probability to edges, as the C pipeline does it, for flights whose force is known already."""

import numpy as np

from airtouch.detector.trace import Detection
from airtouch.parameters import DEFAULT, Parameters
from airtouch.reference.edge_pipeline import ENTRY, NONE
from airtouch.reference.edge_pipeline import decode as reference_decode


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
    edges = detections(reference_decode(probability, armed, parameters), probability)
    return edges if alert is None else physical_filter(edges, alert, parameters.alert_hold)


def detections(edge: np.ndarray, probability: np.ndarray) -> list[Detection]:
    """Edge codes (n,) of the pipeline, C or reference, as detections."""
    found = []
    for sample in np.flatnonzero(edge != NONE):
        entry = edge[sample] == ENTRY
        p = float(probability[sample])
        found.append(Detection(int(sample), "entry" if entry else "exit", p if entry else 1.0 - p))
    return found


def physical_filter(edges: list[Detection], alert: np.ndarray, hold: int) -> list[Detection]:
    """The edges with an FR-CFAR alert among the `hold` samples that end with theirs (paper, section 5.1)."""
    alerts = np.concatenate([[0], np.cumsum(alert)])
    return [e for e in edges if alerts[e.sample + 1] > alerts[max(e.sample + 1 - hold, 0)]]
