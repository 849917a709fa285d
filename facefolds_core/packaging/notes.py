"""What a user should know of an asset that was packed without an error."""

from __future__ import annotations

from facefolds_core.params import VideoCodec


def codec_warning(reached: float | None, video: VideoCodec, noticed: float) -> str | None:
    """A line where `target_psnr` was not reached, with what to do.

    Args:
        reached: dB to what went in, None if unknown.
        noticed: dB below the target from which on it is said.
    """
    target = video.target_psnr
    if reached is None or target is None or video.lossless or reached > target - noticed:
        return None
    return (
        f"warning: the video reaches {reached:.1f} dB of the {target:g} of compress.video.target_psnr: finer "
        "quantisation gives no more; finer textures (texture.resolution) or fewer specks in them do (look at fit.png)"
    )
