"""Video codecs: each module of this package describes one as its `CODEC`, named as in params.yaml and the manifest.

Every encoder runs with one thread and code that does not depend on the time: the same input gives the same bytes. None
reorders pictures between packets (VP9's and AV1's hidden references travel inside the packets), and every key frame
starts a closed group of pictures.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Literal, Protocol

from facefolds_core import registry

if TYPE_CHECKING:
    CodecName = str
else:
    CodecName = Literal[registry.CODECS.names]


class VideoSettings(Protocol):
    """How a texture video is encoded: `compress.video` of params.yaml, or anything else with these."""

    @property
    def codec(self) -> Sequence[CodecName]: ...
    @property
    def crf(self) -> int: ...
    @property
    def preset(self) -> str: ...
    @property
    def keyframe_interval(self) -> int: ...


@dataclass(frozen=True)
class Stream:
    """What a codec's name for browsers depends on.

    Attributes:
        header: the container's codec configuration.
        size: (width, height).
        rate: frames a second.
        bits_a_second: of the file.
    """

    header: bytes
    size: tuple[int, int]
    rate: Fraction
    bits_a_second: float


@dataclass(frozen=True)
class Codec:
    """A codec as writer and reader use it.

    Attributes:
        name: in params.yaml and the manifest; that of its module, and FFmpeg's for its streams.
        encoder: FFmpeg's name.
        decoder: FFmpeg's name of the one that notices most damage.
        container: and suffix of the file.
        worst_crf: of the encoder's scale.
        options: FFmpeg's options for settings and a crf on the encoder's own scale.
        level_and_mime: a stream's level, such as "5.1", and its MIME type with codec string (RFC 6381 and the codecs'
            own rules).
        regions: whether the encoder knows regions (asset/regions.py).
        crf_scale, crf_offset: crf of this encoder = scale * (crf of x264) + offset, for about equal quality.
        of_part: the options for a part of a video, whose first picture has none before it to go by.
    """

    name: CodecName
    encoder: str
    decoder: str
    container: Literal["mp4", "webm"]
    worst_crf: int
    options: Callable[[VideoSettings, int], dict[str, str]]
    level_and_mime: Callable[[Stream], tuple[str, str]]
    crf_scale: float = 1.0
    crf_offset: float = 0.0
    regions: bool = False
    of_part: Callable[[dict[str, str]], dict[str, str]] = dict

    def crf(self, x264_crf: int) -> int:
        """The encoder's own constant rate factor for about the quality of x264's."""
        return min(self.worst_crf, max(1, round(self.crf_scale * x264_crf + self.crf_offset)))


def joined(**options: object) -> str:
    """Options as x264 and SVT-AV1 take them: "a=1:b=2"."""
    return ":".join(f"{key}={value}" for key, value in options.items())


CODECS: dict[str, Codec] = {name: registry.CODECS[name].CODEC for name in registry.CODECS.names}
"""Name -> codec, of all modules of this package; last here, since they import what stands above."""
