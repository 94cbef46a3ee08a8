"""The `best` detector, a `registry.Detector`: a small causal network over twelve motion channels.

detector      run, load: flight logs in, traces out
fitting       fit: flight logs in, a model out
fit_settings  what `fit` may be told beside flights and seed
recipe        every number of the network's shape and training; its graph, as a list of layers
operations    what each operation of the graph is in NumPy, Keras, TensorFlow and int8
network       the graph in NumPy, Keras and TensorFlow
outputs       what each logit says and is trained to say
batches       flights as channels and targets; crops of them, augmented
training      long crops, one cycle of the learning rate, pruning on the way
quantisation  float weights to int8
model         the model file
export        C sources for `gap8/kernels/stream_int8.h`
"""

from airtouch.detector.best.detector import (
    DECODER,
    DECODER_WITHOUT,
    KINDS,
    SPARE_SENSORS,
    TIMING_SIGMA_S,
    arm_pwm,
    flight_events,
    lag_s,
    load,
    model_for,
    parameters,
    run,
    run_float,
    trace_of,
)
from airtouch.detector.best.fit_settings import FINE_TUNING, FitSettings
from airtouch.detector.best.fitting import fit, pseudo_labels, with_lag
from airtouch.detector.best.model import BestModel
from airtouch.detector.best.recipe import Recipe

__all__ = ["DECODER", "DECODER_WITHOUT", "FINE_TUNING", "KINDS", "SPARE_SENSORS", "TIMING_SIGMA_S", "BestModel",
           "FitSettings", "Recipe", "arm_pwm", "fit", "flight_events", "lag_s", "load", "model_for", "parameters",
           "pseudo_labels", "run", "run_float", "trace_of", "with_lag"]
