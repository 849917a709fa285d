"""The texture videos through PyAV, so that frame k of the file is frame k of the sequence.

Decoding order is presentation order, and every `keyframe_interval` frames a key frame starts a closed group: the file
needs no edit list, and a player that scrubs decodes at most that many pictures. See codecs/ for what differs between
codecs.
"""

from __future__ import annotations

import errno
import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, BinaryIO, cast

import av
import numpy as np
from av.error import FFmpegError
from av.video.reformatter import ColorRange, Colorspace
from numpy.typing import NDArray

from facefolds_core.asset.codecs import CODECS, Codec, Stream
from facefolds_core.asset.colour import (
    BLACK,
    NEUTRAL,
    Plane,
    alpha_to_luma,
    luma_to_alpha,
    rgb_to_yuv420,
    yuv420_to_rgb,
)
from facefolds_core.asset.containers import container_of, kind_of
from facefolds_core.asset.packing import GUTTER, MAX_PIXELS, AtlasLayout, cut, fill_cell
from facefolds_core.asset.regions import Marker, Region
from facefolds_core.errors import UserError
from facefolds_core.system.scheduling import kept_scheduling

_PRIMARIES_BT709 = 1
_TRANSFER_SRGB = 13  # IEC 61966-2-1 in ITU-T H.273

CHECKED = {"err_detect": "crccheck+bitstream+buffer+explode"}
"""Damage is an error: nothing is made up in its place. What H.264's decoder conceals all the same, it marks."""
STRICT = CHECKED | {"max_pixels": str(MAX_PIXELS)}
NO_ROOM = (errno.ENOSPC, errno.EDQUOT)
"""A full disk or quota, which stages report as such: no fault of what is written."""
BT709_LIMITED = (1, 1)
"""Matrix and range of an asset's videos, as `VideoFacts.tags`."""
FORMATS = {"mp4": "mp4", "webm": "matroska"}
"""Container -> FFmpeg's demuxer: never one of its guesses, some of which open other files."""

Picture = NDArray[np.uint8]
"""A planar 4:2:0 picture as PyAV lays it out: (3/2 height, width), Y above Cb above Cr."""


@dataclass(frozen=True)
class VideoFacts:
    """What a video file says of itself.

    Attributes:
        level: of the codec, e.g. "5.1".
        mime: MIME type with codec string (RFC 6381).
        rate: frames a second.
        tags: (matrix, range) codes of H.273 / FFmpeg.
    """

    codec: str
    container: str
    level: str
    mime: str
    pixel_format: str
    width: int
    height: int
    rate: Fraction
    tags: tuple[int, int]


def pack_frame(textures: Sequence[NDArray[np.uint8]], layout: AtlasLayout) -> Picture:
    """Layers' textures, N of (h, w, 4) RGBA -> the picture that is encoded. Each cell is converted by itself.

    `layout` must be `AtlasLayout.pack`'s.
    """
    height, width = layout.height, layout.width
    y = np.full((height, width), BLACK, np.uint8)
    cb = np.full((height // 2, width // 2), NEUTRAL, np.uint8)
    cr = cb.copy()
    top = layout.alpha_rect[1]
    for texture, (x, y0, _, _) in zip(textures, layout.rects, strict=True):
        cell = fill_cell(texture, layout.unit)
        left, up = x - GUTTER * layout.unit, y0 - GUTTER * layout.unit
        down, right = up + cell.shape[0], left + cell.shape[1]
        half = (slice(up // 2, down // 2), slice(left // 2, right // 2))
        y[up:down, left:right], cb[half], cr[half] = rgb_to_yuv420(cell[..., :3])
        y[top + up : top + down, left:right] = alpha_to_luma(cell[..., 3])
    return np.concatenate([y, cb.reshape(-1, width), cr.reshape(-1, width)])


def planes(picture: Picture) -> tuple[Plane, Plane, Plane]:
    """Y (height, width), Cb and Cr (height / 2, width / 2)."""
    height, width = 2 * len(picture) // 3, picture.shape[1]
    cb, cr = picture[height:].reshape(2, height // 2, width // 2)
    return picture[:height], cb, cr


def unpack_picture(picture: Picture, layout: AtlasLayout) -> tuple[NDArray[np.uint8], ...]:
    """A decoded picture -> the layers' textures, N of (h, w, 4) RGBA."""
    y, cb, cr = planes(picture)
    x0, y0, w, h = layout.colour_rect
    half = (slice(y0 // 2, (y0 + h) // 2), slice(x0 // 2, (x0 + w) // 2))
    colour = yuv420_to_rgb(y[y0 : y0 + h, x0 : x0 + w], cb[half], cr[half])
    x1, y1, _, _ = layout.alpha_rect
    alpha = luma_to_alpha(y[y1 : y1 + h, x1 : x1 + w])
    return cut(np.concatenate([colour, alpha[..., None]], -1), layout.rects)


def written(path: Path, container: str) -> Any:
    """A file to write packets to, of a kind of `FORMATS`: PyAV's container. The same packets give the same bytes."""
    faststart = {"movflags": "faststart"} if container == "mp4" else {}
    return av.open(str(path), "w", format=container, options={"fflags": "bitexact"} | faststart)


def encode_video(
    path: Path,
    pictures: Iterable[Picture],
    size: tuple[int, int],
    fps: Fraction,
    codec: Codec,
    options: dict[str, str],
    regions: Sequence[Region] = (),
) -> int:
    """Encode planar pictures of `size` (width, height); returns how many.

    Args:
        options: of the encoder, `codec.options(...)`.
        regions: coded finer or coarser, by encoders that know regions.

    Raises:
        UserError: if the encoder refuses.
    """
    count, mark = 0, Marker(size, fps, regions) if regions else None
    os.environ.setdefault("SVT_LOG", "1")  # SVT-AV1 writes to stderr by itself; 1: errors only
    try:
        with written(path, codec.container) as container:
            stream: Any = container.add_stream(codec.encoder, rate=fps, options=options)
            _describe(stream, size, fps)
            with kept_scheduling():
                container.start_encoding()
            for picture in pictures:
                frame = av.VideoFrame.from_ndarray(picture, format="yuv420p")
                frame.colorspace, frame.color_range = Colorspace.ITU709, ColorRange.MPEG
                frame.pts, frame.time_base = count, 1 / fps
                container.mux(stream.encode(frame if mark is None else mark(frame)))
                count += 1
            container.mux(stream.encode(None))
    except FFmpegError as error:
        if error.errno in NO_ROOM:
            raise
        raise UserError(
            "the video encoder refused the textures",
            file=path,
            place=f"{codec.name}, frame {count}, {size[0]} x {size[1]} pixels",
            found=str(error),
            remedy="use a smaller texture.resolution, or another compress.video.codec",
        ) from None
    return count


def _describe(stream: Any, size: tuple[int, int], fps: Fraction) -> None:
    stream.width, stream.height = size
    stream.pix_fmt = "yuv420p"
    context = stream.codec_context
    context.time_base = 1 / fps
    context.thread_count = 1
    context.colorspace, context.color_range = Colorspace.ITU709, ColorRange.MPEG
    context.color_primaries, context.color_trc = _PRIMARIES_BT709, _TRANSFER_SRGB


@contextmanager
def _opened(path: Path, part: BinaryIO | None = None) -> Iterator[tuple[Any, Any, str]]:
    """(container, its video stream, "mp4" or "webm").

    Args:
        part: the header and some fragments of the file, in the place of the file.

    Raises:
        UserError: if the file is missing or is not a video; also for errors of FFmpeg inside the block.
    """
    try:
        kind = container_of(path) if part is None else kind_of(part, fragments=True)
        if part is not None:
            part.seek(0)
        with av.open(
            f"file:{path}" if part is None else part,
            format=FORMATS[kind],
            container_options=CHECKED,
            stream_options=cast(Any, [STRICT]),
        ) as container:
            if not container.streams.video:
                raise _damaged(path, "it has no video stream")
            stream = container.streams.video[0]
            if stream.codec_context is None:
                raise _damaged(path, "its video stream is of no known codec")
            yield container, stream, kind
    except FileNotFoundError:
        raise UserError("file not found", file=path, remedy="make the asset again, or copy it again") from None
    except (FFmpegError, ValueError) as error:  # PyAV: metadata that are no text, a file without streams
        raise _damaged(path, str(error)) from None


def _damaged(path: Path, found: str) -> UserError:
    return UserError("damaged texture video", file=path, found=found, remedy="make the asset again, or copy it again")


def _codec(name: str, path: Path) -> Codec:
    if name not in CODECS:
        raise _damaged(path, f"a video of the codec {name}, not {', '.join(CODECS)}")
    return CODECS[name]


def probe_video(path: Path, part: BinaryIO | None = None, rate: Fraction | None = None, frames: int = 0) -> VideoFacts:
    """Read a video's header.

    Args:
        part: of a file in fragments, its header and the first of them; then `rate` and `frames` of the whole, too.

    Raises:
        UserError: if it cannot be opened, or its codec is none of `CODECS`.
    """
    with _opened(path, part) as (container, stream, kind):
        context = stream.codec_context
        codec, size = context.codec.canonical_name, (context.width, context.height)
        seconds = (container.duration or 0) / av.time_base if rate is None else frames / rate
        rate = (stream.average_rate if rate is None else rate) or Fraction(0)
        bits = float(8 * path.stat().st_size / seconds) if seconds else 0.0
        facts = Stream(bytes(context.extradata or b""), size, rate, bits)
        level, mime = _codec(codec, path).level_and_mime(facts)
        mime = mime.replace("video/webm", f"video/{kind}")
        return VideoFacts(
            codec=codec,
            container=kind,
            level=level,
            mime=mime,
            pixel_format=context.pix_fmt or "unknown",
            width=context.width,
            height=context.height,
            rate=rate,
            tags=(int(context.colorspace), int(context.color_range)),
        )


def key_frames(path: Path) -> list[int]:
    """The numbers of the pictures that can be decoded without the ones before, by the container's marks.

    Raises:
        UserError: if the file cannot be read.
    """
    with _opened(path) as (container, stream, _):
        packets = (packet for packet in container.demux(stream) if packet.size)
        return [number for number, packet in enumerate(packets) if packet.is_keyframe]


def decode_video(
    path: Path, size: tuple[int, int], fps: float, start: int = 0, part: BinaryIO | None = None
) -> Iterator[Picture]:
    """Decode the pictures from frame `start` on, one at a time; strictly: damage that the decoder notices is an error.

    Args:
        size: (width, height) that the pictures must have.
        fps: frames a second, by which time stamps become frame numbers.
        start: first frame wanted; decoding starts at the key frame before it.
        part: the header and some fragments of the file, in the place of the file; not before the key frame before
            `start`.

    Raises:
        UserError: if the file is damaged, its size is another, or a frame is missing.
    """
    with _opened(path, part) as (container, stream, _):
        if (stream.codec_context.width, stream.codec_context.height) != size:
            found = f"{stream.codec_context.width} x {stream.codec_context.height}"
            raise _damaged(path, f"pictures of {found} pixels instead of {size[0]} x {size[1]}")
        if start and part is None:
            container.seek(round(start / fps / stream.time_base), stream=stream, backward=True)
        previous = None
        for frame in _strictly_decoded(container, stream, path):
            number = round(float(frame.pts * stream.time_base) * fps) if frame.pts is not None else -1
            if number > start if previous is None else number != previous + 1:
                raise _damaged(path, f"frame {number} comes after {'nothing' if previous is None else previous}")
            previous = number
            if frame.is_corrupt:
                raise _damaged(path, f"frame {number} cannot be decoded whole")
            if (frame.width, frame.height) != size or frame.format.name != "yuv420p":
                raise _damaged(path, f"frame {number} is {frame.width} x {frame.height} {frame.format.name}")
            if number >= start:
                yield frame.to_ndarray()


def _strictly_decoded(container: Any, stream: Any, path: Path) -> Iterator[Any]:
    """PyAV's frames of a stream, by the codec's strictest decoder."""
    given = stream.codec_context
    context: Any = av.CodecContext.create(_codec(given.codec.canonical_name, path).decoder, "r")
    context.extradata, context.thread_type, context.thread_count = given.extradata, "AUTO", 0
    context.options = STRICT
    for packet in container.demux(stream):
        if packet.is_corrupt:
            raise _damaged(path, "a picture's data are cut off")
        yield from context.decode(packet if packet.size else None)
