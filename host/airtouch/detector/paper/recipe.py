"""The recipe of the paper's network: every number of its training that a caller may change."""

from dataclasses import dataclass

import numpy as np

from airtouch.detector.paper.losses import DEFAULT_LAMBDA
from airtouch.detector.shared.pruning import BLOCK
from airtouch.errors import AirTouchError

EPOCHS = 10  #: the 200 of the paper overfit once flights are held out (host/docs/train.md)
SPARSITY = 0.8  #: fraction of zeros in the first dense layer; its cost: host/docs/ablations.md


@dataclass(frozen=True)
class PaperRecipe:
    """The settings of a training of `paper`: with the flights and the seed they give its bits.

    Raises AirTouchError for a value out of range.
    """

    epochs: int = EPOCHS  #: at most, 1 or more; training stops early on the flights held out
    sparsity: float = SPARSITY  #: share of zeros in the first dense layer, 0 to below 1
    block: int = BLOCK  #: neighbouring inputs that are pruned together: 4, which the C kernels run sparse, or 1
    df_lambda: float = DEFAULT_LAMBDA  #: weight of the disturbance-force loss, 0 or more
    conv_sparsity: float = 0.0  #: share of zeros in the second convolution, 0 to below 1; the paper prunes none there
    fixed_scale: bool = False  #: inputs on a fixed scale instead of z-scored windows, so that the network can roll

    def __post_init__(self) -> None:
        if self.epochs < 1:
            raise AirTouchError(f"training: epochs must be at least 1, not {self.epochs}")
        for share in (self.sparsity, self.conv_sparsity):
            if not 0.0 <= share < 1.0:
                raise AirTouchError(f"training: sparsity must lie in 0..1, below 1, not {share}")
        if self.block not in (1, BLOCK):
            raise AirTouchError(f"training: blocks of 1 or {BLOCK} weights, not {self.block}")
        if not (np.isfinite(self.df_lambda) and self.df_lambda >= 0):
            raise AirTouchError(f"training: lambda must be 0 or more, not {self.df_lambda}")
