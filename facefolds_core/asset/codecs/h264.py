"""H.264 in MP4, by x264: what every browser and nearly every player plays."""

from __future__ import annotations

from facefolds_core.asset.codecs import Codec, Stream, VideoSettings, joined

X264_FIXED = {
    "scenecut": 0,
    "open-gop": 0,
    "bframes": 0,
    "chromaloc": 1,  # centre
    # The next three are for the eye: ST-LPIPS .050 instead of .065 at equal bytes on mugsy, for 0.03 dB
    # (docs/research/codec.md).
    "psy": 1,
    "psy-rd": "1.0,0",  # beyond 1.0, and with its second number (trellis), more bytes for as little error
    "deblock": "-3,-3",  # what this filter smooths are pores and hairs as often as the edges of blocks
    "chroma-qp-offset": -4,  # a wrong hue shows: +0.5 dB of rendered views for 3 % of the bytes
    "threads": 4,  # fixed: the stream depends on it, but on no machine's cores; within 2 % of one thread's bytes
    "cpu-independent": 1,
}


def _options(params: VideoSettings, crf: int) -> dict[str, str]:
    interval = params.keyframe_interval
    fixed = {"keyint": interval, "min-keyint": interval, **X264_FIXED}
    if params.preset in ("slower", "veryslow"):
        # 5 reference pictures, as `slow` has: with their 8 and 16 the stream asks for a higher level, and of decoders
        # for more memory. Textures stand still, so that they hardly gain by them.
        fixed["ref"] = 5
    return {"crf": str(crf), "preset": params.preset, "x264-params": joined(**fixed)}


def _level_and_mime(stream: Stream) -> tuple[str, str]:
    # ISO/IEC 14496-15, AVCDecoderConfigurationRecord: bytes 1 to 3 are the profile, its constraints and the level.
    profile = stream.header[1:4] if len(stream.header) > 3 else bytes(3)
    return f"{profile[2] / 10:g}", f'video/mp4; codecs="avc1.{profile.hex()}"'


def _of_part(options: dict[str, str]) -> dict[str, str]:
    """The first picture gets 1.5 times the bits. x264 gives key frames more than the pictures before them, but knows
    none at the start; and what keeps still is copied from there: 8 % less bytes at equal PSNR than in one go."""
    return {**options, "x264-params": options["x264-params"] + ":zones=0,0,b=1.5"}


CODEC = Codec("h264", "libx264", "h264", "mp4", 51, _options, _level_and_mime, of_part=_of_part, regions=True)
