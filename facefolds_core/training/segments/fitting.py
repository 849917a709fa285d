"""A segment fitted and written: in this process, or in one of its own."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from facefolds_core.training.segments.cache import SegmentCache
from facefolds_core.training.segments.frames import FrameFitter
from facefolds_core.training.segments.plan import Segment


def fit_segment(segment: Segment, fitter: FrameFitter, cache: SegmentCache, tell: Callable[[], None]) -> int:
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
