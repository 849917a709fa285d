"""What a user should know of an asset that was packed without an error."""

from __future__ import annotations

from facefolds_core.facts import Fact, fact
from facefolds_core.params import VideoCodec

NOTICED = 0.5
"""A target missed by more than this, dB, is said."""


def codec_warning(reached: float | None, video: VideoCodec) -> Fact | None:
    """A fact where `target_psnr` was not reached, with what to do.

    Args:
        reached: dB to what went in, None if unknown.
    """
    target = video.target_psnr
    if reached is None or target is None or reached > target - NOTICED:
        return None
    return fact("codec_misses", reached=reached, target=target)
