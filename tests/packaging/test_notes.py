"""What is said of an asset that was packed without an error."""

from __future__ import annotations

from facefolds_core.asset.manifest import Quality
from facefolds_core.packaging.notes import codec_warning


def test_a_missed_target_is_said_with_a_remedy() -> None:
    line = str(codec_warning(Quality(psnr_to_model=40.2, target_psnr=41)))
    assert "40.2 dB of the 41.0" in line and "texture.resolution" in line
    assert codec_warning(Quality(psnr_to_model=40.9, target_psnr=41)) is None
    assert codec_warning(Quality(psnr_to_model=37.0)) is None
    assert codec_warning(None) is None
