"""What is said of an asset that was packed without an error."""

from __future__ import annotations

from facefolds_core.packaging.notes import codec_warning
from facefolds_core.params import VideoCodec


def test_a_missed_target_is_said_with_a_remedy() -> None:
    video = VideoCodec(target_psnr=41)
    line = str(codec_warning(40.2, video))
    assert "40.2 dB of the 41" in line and "texture.resolution" in line
    assert codec_warning(40.9, video) is None
    assert codec_warning(None, video) is None
    assert codec_warning(37.0, VideoCodec(target_psnr=None, crf=30)) is None
