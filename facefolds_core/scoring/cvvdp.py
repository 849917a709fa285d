"""ColorVideoVDP (Mantiuk et al. 2024), a distance of films as the eye sees them, where the package cvvdp is installed.

10 JOD (just-objectionable differences) is no visible difference; 9 is one that 75 % of people would see as worse.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from facefolds_core.scoring.images import subject_box
from facefolds_core.scoring.metrics import Array
from facefolds_core.scoring.perceptual import VideoDistance

Frames = NDArray[np.uint8]
"""(F, H, W, 3)."""
JUDGED = ("model", "asset")


class Screening:
    """The first frames of one camera's film, of the subject alone, to be judged together.

    Args:
        distance: None keeps nothing.
        most: frames that are kept.
    """

    def __init__(self, distance: VideoDistance | None, most: int) -> None:
        self._distance, self._most = distance, most
        self._frames: dict[str, list[Frames]] = {}
        self._seen: Array | None = None

    def add(self, pictures: Mapping[str, Array], truth: Array, weight: Array) -> None:
        """Args: as of `temporal.Film.add`, in the order of the frames."""
        if self._distance is None or len(self._frames.get("truth", ())) >= self._most:
            return
        self._seen = weight if self._seen is None else np.maximum(self._seen, weight)
        for name, picture in {"truth": truth, **{key: pictures[key] for key in JUDGED}}.items():
            self._frames.setdefault(name, []).append(np.rint(255 * weight[..., None] * picture).astype(np.uint8))

    def judge(self, fps: float) -> dict[str, float]:
        """JOD of each variant; empty with less than two frames, or without a subject."""
        box = None if self._seen is None else subject_box(self._seen)
        if self._distance is None or box is None or len(self._frames["truth"]) < 2:
            return {}
        films = {name: np.stack([frame[box] for frame in frames]) for name, frames in self._frames.items()}
        return {name: self._distance(films[name], films["truth"], fps) for name in JUDGED}


def mean_jod(judged: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """Over cameras, by variant."""
    found = {name: [one[name] for one in judged if name in one] for name in JUDGED}
    return {name: sum(values) / len(values) for name, values in found.items() if values}
