"""What differs between the video codecs: encoder, container, options, levels and the names that browsers ask for.

Every encoder runs with one thread and code that does not depend on the time: the same input gives the same bytes. None
reorders pictures between packets (VP9's and AV1's hidden references travel inside the packets), and every key frame
starts a closed group of pictures.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Literal, Protocol

from facefolds_core.errors import UserError

CodecName = Literal["h264", "vp9", "av1"]


class VideoSettings(Protocol):
    """How a texture video is encoded: `compress.video` of params.yaml, or anything else with these."""

    @property
    def codec(self) -> Sequence[CodecName]: ...
    @property
    def crf(self) -> int: ...
    @property
    def lossless(self) -> bool: ...
    @property
    def preset(self) -> str: ...
    @property
    def keyframe_interval(self) -> int: ...


X264_FIXED = {
    "scenecut": 0,
    "open-gop": 0,
    "bframes": 0,
    "chromaloc": 0,
    "psy": 0,  # a texture is warped and blended before it is seen: +0.25 dB at equal size
    "chroma-qp-offset": -4,  # a wrong hue shows: +0.5 dB of rendered views for 3 % of the bytes
    "threads": 1,
    "cpu-independent": 1,
}
VP9_FIXED = {"b": "0", "deadline": "good", "cpu-used": "3", "row-mt": "0", "auto-alt-ref": "1", "lag-in-frames": "16"}
SVT_FIXED = {"lp": 1, "scd": 0, "irefresh-type": 2, "chroma-sample-position": "left"}
SVT_PRESET = "6"

# Level, then the greatest: luma samples a second, samples a picture, kilobits a second, pixels a side
# (webmproject.org/vp9/levels).
VP9_LEVELS = (
    ("1", 829_440, 36_864, 200, 512),
    ("1.1", 2_764_800, 73_728, 800, 768),
    ("2", 4_608_000, 122_880, 1_800, 960),
    ("2.1", 9_216_000, 245_760, 3_600, 1_344),
    ("3", 20_736_000, 552_960, 7_200, 2_048),
    ("3.1", 36_864_000, 983_040, 12_000, 2_752),
    ("4", 83_558_400, 2_228_224, 18_000, 4_160),
    ("4.1", 160_432_128, 2_228_224, 30_000, 4_160),
    ("5", 311_951_360, 8_912_896, 60_000, 8_384),
    ("5.1", 588_251_136, 8_912_896, 120_000, 8_384),
    ("5.2", 1_176_502_272, 8_912_896, 180_000, 8_384),
    ("6", 1_176_502_272, 35_651_584, 180_000, 16_832),
    ("6.1", 2_353_004_544, 35_651_584, 240_000, 16_832),
    ("6.2", 4_706_009_088, 35_651_584, 480_000, 16_832),
)


@dataclass(frozen=True)
class Codec:
    """A codec as the writer uses it.

    Attributes:
        name: in params.yaml and the manifest.
        encoder: FFmpeg's name.
        container: and suffix of the file.
        worst_crf: of the encoder's scale.
        crf_scale, crf_offset: crf of this encoder = scale * (crf of x264) + offset, for about equal quality.
    """

    name: CodecName
    encoder: str
    container: Literal["mp4", "webm"]
    worst_crf: int
    crf_scale: float = 1.0
    crf_offset: float = 0.0

    def crf(self, x264_crf: int) -> int:
        """The encoder's own constant rate factor for about the quality of x264's."""
        return min(self.worst_crf, max(1, round(self.crf_scale * x264_crf + self.crf_offset)))

    def options(self, params: VideoSettings, crf: int) -> dict[str, str]:
        """FFmpeg's options; `crf` on the encoder's own scale."""
        interval = params.keyframe_interval
        if self.name == "h264":
            fixed = {"keyint": interval, "min-keyint": interval, **X264_FIXED}
            quality = {"qp": "0"} if params.lossless else {"crf": str(crf)}
            return {**quality, "preset": params.preset, "x264-params": _joined(**fixed)}
        if self.name == "vp9":
            quality = {"lossless": "1"} if params.lossless else {"crf": str(crf)}
            return {**VP9_FIXED, **quality, "g": str(interval), "keyint_min": str(interval)}
        fixed_svt = {**SVT_FIXED, **({"lossless": 1} if params.lossless else {})}
        quality = {} if params.lossless else {"crf": str(crf)}
        return {"preset": SVT_PRESET, "g": str(interval), **quality, "svtav1-params": _joined(**fixed_svt)}


CODECS = {
    codec.name: codec
    for codec in (
        Codec("h264", "libx264", "mp4", 51),
        Codec("vp9", "libvpx-vp9", "webm", 63, 2.0, -4.0),
        Codec("av1", "libsvtav1", "mp4", 63, 2.0, -6.0),
    )
}


def _joined(**options: object) -> str:
    return ":".join(f"{key}={value}" for key, value in options.items())


def level_and_mime(
    codec: str, header: bytes, size: tuple[int, int], rate: Fraction, bits_a_second: float
) -> tuple[str, str]:
    """A stream's level, and its MIME type with codec string (RFC 6381 and the codecs' own rules).

    Args:
        header: the container's codec configuration.
        size: (width, height).

    Returns:
        level such as "5.1", MIME type.
    """
    if codec == "h264":
        # ISO/IEC 14496-15, AVCDecoderConfigurationRecord: bytes 1 to 3 are the profile, its constraints and the level.
        profile = header[1:4] if len(header) > 3 else bytes(3)
        return f"{profile[2] / 10:g}", f'video/mp4; codecs="avc1.{profile.hex()}"'
    if codec == "vp9":
        level = _vp9_level(size, rate, bits_a_second)
        # Profile 0, 8 bits, 4:2:0 sited left, primaries BT.709, transfer sRGB, matrix BT.709, limited range.
        return level, f'video/webm; codecs="vp09.00.{round(10 * float(level)):02d}.08.00.01.13.01.00"'
    # AV1 codec configuration record: byte 1 is seq_profile (3 bits) and seq_level_idx_0 (5 bits).
    index = header[1] & 0x1F if len(header) > 1 else 0
    level = f"{2 + index // 4}.{index % 4}".removesuffix(".0")
    return (
        level,
        f'video/mp4; codecs="av01.{header[1] >> 5 if len(header) > 1 else 0}.{index:02d}M.08.0.111.01.13.01.0"',
    )


def _vp9_level(size: tuple[int, int], rate: Fraction, bits_a_second: float) -> str:
    pixels = size[0] * size[1]
    for level, samples, picture, kilobits, side in VP9_LEVELS:
        if pixels <= picture and pixels * rate <= samples and max(size) <= side and bits_a_second <= 1000 * kilobits:
            return level
    raise UserError(
        "a video beyond the highest level of VP9",
        found=f"{size[0]} x {size[1]} pixels at {float(rate):g} a second, {bits_a_second / 1e6:.0f} Mbit/s",
        remedy="use a smaller texture.resolution, or a larger compress.video.crf",
    )
