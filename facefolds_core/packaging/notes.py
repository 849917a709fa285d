"""What a user should know of an asset that was packed without an error."""

from __future__ import annotations

from facefolds_core.asset.manifest import Quality
from facefolds_core.facts import Fact, fact

NOTICED = 0.5
"""A target missed by more than this, dB, is said."""


def codec_warning(quality: Quality | None) -> Fact | None:
    """A fact where a level does not reach what its encoder was asked for, with what to do."""
    if quality is None or quality.target_psnr is None or quality.psnr_to_model > quality.target_psnr - NOTICED:
        return None
    return fact("codec_misses", reached=quality.psnr_to_model, target=quality.target_psnr)
