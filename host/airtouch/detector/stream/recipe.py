"""Shape of the streaming network and how it is trained."""

import math
from dataclasses import dataclass, replace

from airtouch.reference.motion_channels import NAMES, MotionConfig

CHANNELS = len(NAMES)  #: values a sample
STRIDE = 2  #: samples between two rows that are computed: 50 Hz
OUTPUTS = 3
OVER, ENTRY, EXIT = range(OUTPUTS)  #: the three logits


@dataclass(frozen=True)
class Recipe:
    """Everything that a trained network follows from, beside flights and seed.

    width: channels of each layer. dilations: rows between the taps of each layer after the first.
    sparsity: share of zero blocks of four in those layers. delay: samples after an edge at which the
    event logits are to peak, spread over event_sigma; the over logit is to change over_delay after it.
    The rest: learning (steps, batch, crop in samples of which warm_up are not scored, one-cycle peak,
    weight decay, loss weights), channels that are muted (held at 0, for ablations) and augmentation (share of crops
    around an edge, flights of the rare heights drawn `balance` times as often, gains, offsets and noise in usual
    swings, yaw in degrees, time warp, share mirrored left to right). silent_acceleration, silent_rates, silent_motors:
    shares of the crops in which that sensor's channels are held at 0, so that one network also runs without it; a
    sensor that no training flight has is always silent. phases: share of the crops that hold take-off or landing.
    free_air_share: share of the crops from flights without edges, where there are such.
    """

    width: int = 24
    first_taps: int = 4
    taps: int = 3
    dilations: tuple[int, ...] = (1, 2, 4, 8, 16, 32)
    sparsity: float = 0.5
    steps: int = 2000
    batch: int = 16
    crop: int = 1024
    warm_up: int = 256
    peak_rate: float = 4e-3
    weight_decay: float = 1e-4
    delay: int = 10
    over_delay: int = 4
    event_sigma: float = 6.0
    event_weight: float = 3.0
    muted: tuple[int, ...] = ()
    edge_share: float = 0.6
    balance: float = 3.0
    gain: float = 0.15
    noise: float = 0.05
    offset: float = 0.1
    yaw_deg: float = 20.0
    warp: float = 0.08
    mirror: float = 0.5
    silent_acceleration: float = 0.15
    silent_rates: float = 0.05
    silent_motors: float = 0.1
    phases: float = 0.15
    free_air_share: float = 0.2

    @property
    def shapes(self) -> tuple[tuple[int, int, int], ...]:
        """(taps, channels in, channels out) of each convolution, then of the head (a tap for each layer it reads)."""
        width = self.width
        inner = [(self.taps, width, width)] * len(self.dilations)
        return ((self.first_taps, CHANNELS, width), *inner, (len(self.dilations), width, OUTPUTS))

    @property
    def receptive_samples(self) -> int:
        """Samples that one output depends on."""
        return (self.taps - 1) * sum(self.dilations) * STRIDE + self.first_taps

    @property
    def motion(self) -> MotionConfig:
        """The channels' settings: a muted channel has no bounds to its usual swing."""
        config = MotionConfig()
        scale = tuple(math.inf if i in self.muted else s for i, s in enumerate(config.scale))
        return replace(config, scale=scale)

    def weight_shapes(self) -> dict[str, tuple[int, ...]]:
        """Name and shape of each float array: kernels (taps, in, out) and biases (out,)."""
        names = [f"layer{i}" for i in range(len(self.shapes))]
        kernels = {f"{name}.kernel": shape for name, shape in zip(names, self.shapes, strict=True)}
        return kernels | {f"{name}.bias": shape[-1:] for name, shape in zip(names, self.shapes, strict=True)}
