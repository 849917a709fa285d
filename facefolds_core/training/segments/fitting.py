"""A segment fitted and written: in this process, or in one of its own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.scene import Scene
from facefolds_core.params import ExplicitParams
from facefolds_core.training.explicit.views import Views
from facefolds_core.training.segments.base import read_base, with_its_cameras
from facefolds_core.training.segments.cache import SegmentCache
from facefolds_core.training.segments.frames import FrameFitter
from facefolds_core.training.segments.plan import Segment


@dataclass(frozen=True)
class Fitting:
    """By what segments are fitted.

    Attributes:
        scene: as it was given to the training.
        params: of the training.
        base: its folder.
        fingerprint: of the base.
        folder: of the segments.
    """

    scene: Scene
    params: ExplicitParams
    base: Path
    fingerprint: str
    folder: Path

    def fitter(self, views: Views | None = None, shine: NDArray[np.float32] | None = None) -> FrameFitter:
        """Args: of a still head, if they are known, `views`: crossings of its rays, `shine`: see `FrameFitter`."""
        base = read_base(self.base, self.fingerprint)
        return FrameFitter(with_its_cameras(self.scene, base), base, self.params, views, shine)

    def cache(self) -> SegmentCache:
        return SegmentCache(self.folder)


def fit_segment(
    segment: Segment, fitter: FrameFitter, cache: SegmentCache, tell: Callable[[], object] = lambda: None
) -> int:
    """Fit its frames but for those that are in the cache, and write its file.

    Args:
        tell: hears of each frame that is done.

    Returns:
        rays that were shaded.

    Raises:
        UserError: if a frame diverges.
    """
    fitted, rays = [], 0
    for frame, name, shares in zip(segment.frames, segment.names, segment.shares, strict=True):
        known = cache.frame(name)
        if known is None:
            one = fitter.fit(frame, np.array(shares), bytes.fromhex(name))
            known = one.colour, one.alpha, one.psnr
            rays += one.rays
        fitted.append(known)
        tell()
    cache.write(segment.names, fitted)
    return rays
