"""How far the training of a level has come, and when it is begun again."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from torch import Tensor

from facefolds_core.training.explicit.plan import Epochs


@dataclass(frozen=True)
class DivergenceParams:
    """When a level of training is begun again, and how often.

    Attributes:
        error_ratio: a squared error this many times the best of its level is a divergence.
        smoothing: share of the newest step in the running mean of the error.
        attempts: each at a lower learning rate; then training ends with a message.
        slow_down: the learning rate is divided by this before a level is begun again.
    """

    error_ratio: float = 9.0
    smoothing: float = 0.1
    attempts: int = 4
    slow_down: float = 3.0


@dataclass
class Attempt:
    """At a level.

    Attributes:
        level: its number.
        saved: values before its first step, to go back to where it diverges (`TextureState.snapshot`).
        epochs: frames in the order of the steps.
        tries: that have diverged.
        step: steps that are done.
        best, recent: smoothed error, the least so far and now.
    """

    level: int
    saved: list[Tensor]
    epochs: Epochs
    tries: int = 0
    step: int = 0
    best: float = float("inf")
    recent: float = float("nan")

    def begin_again(self, epochs: Epochs) -> None:
        """From its start, at a lower learning rate."""
        self.tries, self.step, self.epochs = self.tries + 1, 0, epochs
        self.best, self.recent = float("inf"), float("nan")

    def heed(self, error: float, params: DivergenceParams) -> bool:
        """Take in the error of a step; False if the level diverges."""
        share = params.smoothing
        self.recent = error if self.step == 0 else (1 - share) * self.recent + share * error
        self.best = min(self.best, self.recent)
        return bool(np.isfinite(error)) and self.recent <= params.error_ratio * self.best + 1e-4
