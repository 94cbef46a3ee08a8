"""The recipe of `best`: the shape of its network, as a list of layers, and every number of its training."""

import math
from dataclasses import dataclass, replace

from airtouch.detector.best.operations import CAUSAL_CONV, HEAD
from airtouch.detector.best.outputs import OUTPUTS
from airtouch.detector.shared.pruning import BLOCK
from airtouch.errors import AirTouchError
from airtouch.reference.motion_channels import NAMES, MotionConfig
from airtouch.reference.networks.stream_graph import StreamLayer, receptive_samples
from airtouch.vehicle import Vehicle

CHANNELS = len(NAMES)  #: values a sample
ROW_STRIDE = 2  #: samples between two rows that are computed: 50 Hz
#: field -> its smallest and largest value, of numbers that are whole; a width is a multiple of BLOCK
LIMITS = {"width": (4, 64), "first_taps": (1, 16), "taps": (1, 8)}
MOST_DILATIONS, MOST_DILATION = 9, 256  #: layers after the first; rows between the taps of one


@dataclass(frozen=True)
class Recipe:
    """The settings of a trained network: with the flights and the seed they give its bits.

    Samples are those of a 100 Hz log. A crop is a piece of a flight, one row of a training batch. Width, steps, delay
    and the choice of crops come from 13 trainings over the five folds, the missing sensors and free air from two more
    (host/docs/looks.md, 2026-11-21 and 22); the other numbers have no source.
    Raises AirTouchError for a shape that the model files and the C kernels do not take.
    """

    # Shape
    width: int = 24  #: values of a row of each layer but the last
    first_taps: int = 4  #: samples that the first layer reads
    taps: int = 3  #: rows that each later layer reads
    dilations: tuple[int, ...] = (1, 2, 4, 8, 16, 32)  #: rows between the taps of each layer after the first
    sparsity: float = 0.5  #: share of the blocks of four weights that are zero, in the layers after the first
    # Learning
    steps: int = 2000  #: batches
    batch: int = 16  #: crops of a batch
    crop: int = 1024  #: samples of a crop
    warm_up: int = 256  #: samples at the start of a crop that have no part in the loss
    peak_rate: float = 4e-3  #: learning rate at the top of the one cycle
    weight_decay: float = 1e-4  #: of AdamW
    # Training targets (outputs.py)
    delay: int = 10  #: samples from an edge to the peak of its event's target
    over_delay: int = 4  #: samples from an edge to the change of the target of "over"
    event_sigma: float = 6.0  #: width of an event's target, samples
    event_weight: float = 3.0  #: weight of an event's loss against that of "over"
    muted: tuple[int, ...] = ()  #: channels that are always 0, for ablations
    # Choice of crops (batches.py)
    edge_share: float = 0.6  #: share of the crops that lie around an edge
    balance: float = 3.0  #: how often flights with edges of 4 cm or more are drawn against the others
    # Augmentation
    gain: float = 0.15  #: standard deviation of the logarithm of a gain that all channels share, and of each one's own
    noise: float = 0.05  #: standard deviation of white noise, in nominal amplitudes of a channel
    offset: float = 0.1  #: standard deviation of a constant offset, in nominal amplitudes of a channel
    yaw_deg: float = 20.0  #: largest turn about the vertical, degrees
    warp: float = 0.08  #: largest stretch of time, share
    mirror: float = 0.5  #: share of the crops that are mirrored left to right
    # Missing sensors, phases and free air
    silent_acceleration: float = 0.15  #: share of the crops without acceleration, so that the network runs without it
    silent_rates: float = 0.05  #: share of the crops without rates
    silent_motors: float = 0.1  #: share of the crops without motors
    #: share of the crops of flights with edges that are drawn at take-off or landing; of flights without edges, divided
    #: by 1 - edge_share
    phases: float = 0.15
    free_air_share: float = 0.2  #: share of the crops from flights without edges, where there are such
    #: its thrust curve, gravity and PWM in the air are those of the motion channels; None for the default vehicle's
    vehicle: Vehicle | None = None

    def __post_init__(self) -> None:
        for name, (low, high) in LIMITS.items():
            _check(name, getattr(self, name), low, high)
        if self.width % BLOCK:
            raise AirTouchError(f"training: width must be a multiple of {BLOCK}, not {self.width}")
        _check("the number of dilations", len(self.dilations), 1, MOST_DILATIONS)
        for dilation in self.dilations:
            _check("a dilation", dilation, 1, MOST_DILATION)
        for channel in self.muted:
            _check("a muted channel", channel, 0, CHANNELS - 1)
        if not 0.0 <= self.sparsity < 1.0:
            raise AirTouchError(f"training: sparsity must lie in 0..1, below 1, not {self.sparsity}")

    @property
    def graph(self) -> tuple[StreamLayer, ...]:
        """The network: a strided convolution, dilated ones, and a head that reads a row of each of those."""
        width, dilated = self.width, range(1, 1 + len(self.dilations))
        return (
            StreamLayer("layer0", CAUSAL_CONV, self.first_taps, CHANNELS, width, stride=ROW_STRIDE),
            *(StreamLayer(f"layer{i}", CAUSAL_CONV, self.taps, width, width, dilation, pruned=True)
              for i, dilation in zip(dilated, self.dilations, strict=True)),
            StreamLayer(f"layer{len(dilated) + 1}", HEAD, len(dilated), width, len(OUTPUTS), relu=False,
                        reads=tuple(dilated)),
        )

    @property
    def receptive_samples(self) -> int:
        """Samples that one output depends on."""
        return receptive_samples(self.graph)

    @property
    def motion(self) -> MotionConfig:
        """The channels' settings: a muted channel has no bounds to its nominal amplitude."""
        config = MotionConfig()
        if self.vehicle is not None:
            config = replace(config, vehicle=self.vehicle, arm_pwm=self.vehicle.arm_pwm)
        scale = tuple(math.inf if i in self.muted else s for i, s in enumerate(config.scale))
        return replace(config, scale=scale)


def _check(name: str, value: object, low: int, high: int) -> None:
    """Raise AirTouchError for anything but a whole number from low to high."""
    if not isinstance(value, int) or isinstance(value, bool) or not low <= value <= high:
        raise AirTouchError(f"training: {name} must be a whole number from {low} to {high}, not {value!r}")
