"""How far the training of a level has come: with the values that are trained, all that its next step depends on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from torch import Tensor

from facefolds_core.training.explicit.plan import Epochs


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

    def heed(self, error: float, smoothing: float, most: float) -> bool:
        """Take in the error of a step; False if the level diverges.

        Args:
            smoothing: share of the newest error in the smoothed one.
            most: times its least that the smoothed error may be.
        """
        self.recent = error if self.step == 0 else (1 - smoothing) * self.recent + smoothing * error
        self.best = min(self.best, self.recent)
        return bool(np.isfinite(error)) and self.recent <= most * self.best + 1e-4
