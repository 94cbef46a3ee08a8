"""The paper's detector, a `registry.Detector`: fused features, int8 network, edges, physical filter.

detector      run, fit, tune, load (section 5)
rolling       the same network a sample at a time: the detector `paper-stream`
features      nine channels to three fused features, disturbance force and FR-CFAR alerts (section 4)
normalisation features to network inputs
graph         the layers, once, and what each operation is (section 5.2)
network       the weights; Keras and C views of the layers
recipe        every number of the training that a caller may change
losses        cross-entropy and the disturbance-force loss
training      windows of flights, one cycle of the learning rate, pruning (sections 5.2, 5.3 and 7.1)
quantisation  float weights to int8 (section 5.3)
decoding      probabilities to edges
model         the model file
export        C sources for `gap8/kernels/network_int8.h` and `rolling_int8.h`
variants      the pipeline with one of its choices changed, for ablations
"""

from airtouch.detector.paper.detector import (
    choose_decoding,
    decoding_settings,
    fit,
    lag_s,
    load,
    parameters,
    probability_of,
    retune,
    run,
    run_float,
    signals,
    stride,
    tune,
)
from airtouch.detector.paper.model import Model

__all__ = ["Model", "choose_decoding", "decoding_settings", "fit", "lag_s", "load", "parameters", "probability_of",
           "retune", "run", "run_float", "signals", "stride", "tune"]
