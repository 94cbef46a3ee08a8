"""Shape of the streaming network and how it is trained."""

import math
from dataclasses import dataclass, replace

from airtouch.reference.edge_decoder import LOGITS
from airtouch.reference.motion_channels import NAMES, MotionConfig
from airtouch.reference.stream_graph import CONV, HEAD, StreamLayer, receptive_samples

CHANNELS = len(NAMES)  #: values a sample
STRIDE = 2  #: samples between two rows that are computed: 50 Hz


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
    def graph(self) -> tuple[StreamLayer, ...]:
        """The network: a strided convolution, dilated ones, and a head that reads a row of each of those."""
        width, dilated = self.width, range(1, 1 + len(self.dilations))
        return (
            StreamLayer("layer0", CONV, self.first_taps, CHANNELS, width, stride=STRIDE),
            *(StreamLayer(f"layer{i}", CONV, self.taps, width, width, dilation, pruned=True)
              for i, dilation in zip(dilated, self.dilations, strict=True)),
            StreamLayer(f"layer{len(dilated) + 1}", HEAD, len(dilated), width, len(LOGITS), relu=False,
                        reads=tuple(dilated)),
        )

    @property
    def receptive_samples(self) -> int:
        """Samples that one output depends on."""
        return receptive_samples(self.graph)

    @property
    def motion(self) -> MotionConfig:
        """The channels' settings: a muted channel has no bounds to its usual swing."""
        config = MotionConfig()
        scale = tuple(math.inf if i in self.muted else s for i, s in enumerate(config.scale))
        return replace(config, scale=scale)
