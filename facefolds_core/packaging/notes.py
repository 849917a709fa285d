"""What a user should know of an asset that was packed without an error."""

from __future__ import annotations

from facefolds_core.facts import Fact, fact
from facefolds_core.params import VideoCodec


def codec_warning(reached: float | None, video: VideoCodec, noticed: float) -> Fact | None:
    """A fact where `target_psnr` was not reached, with what to do.

    Args:
        reached: dB to what went in, None if unknown.
        noticed: dB below the target from which on it is said.
    """
    target = video.target_psnr
    if reached is None or target is None or video.lossless or reached > target - noticed:
        return None
    return fact("codec_misses", reached=reached, target=target)
