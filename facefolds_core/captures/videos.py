"""Videos of a capture: checked without decoding, then decoded once, in order, strictly.

Frame k of a camera is the k-th picture that the file shows. So a rate that varies, a tag that turns the picture, an
offset in time and a file that was cut off are refused here, with the frame: each would put other moments or places
side by side than the calibration means.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal, cast

import av
import numpy as np
from av.error import FFmpegError
from av.video.reformatter import Interpolation, VideoReformatter
from numpy.typing import NDArray

from facefolds_core.errors import UserError
from facefolds_core.files.reading import check_regular

Image = NDArray[np.uint8]
Channels = Literal["rgb", "opacity"]

STRICT = {"err_detect": "crccheck+bitstream+buffer+explode"}
"""Damage is an error: nothing is made up in its place."""
CONTAINERS = {
    ".mp4": "mov", ".m4v": "mov", ".mov": "mov", ".mkv": "matroska", ".webm": "matroska", ".avi": "avi",
}  # fmt: skip
"""FFmpeg's demuxer by extension: never one of its guesses, some of which open other files."""
_DISCARDED = 2
"""A flag of FFmpeg's index: an edit list takes this picture out."""
_FINE = Interpolation.BILINEAR | Interpolation.ACCURATE_RND | Interpolation.FULL_CHR_H_INT
_REMEDY = "copy the file again from its source, or take this camera out of the capture"


@dataclass(frozen=True)
class IndexFacts:
    """What a video's index says.

    Attributes:
        size: (width, height), pixels.
        count: its number of frames.
        rate: frames a second.
        start: when the first one is shown, seconds.
    """

    size: tuple[int, int]
    count: int
    rate: Fraction
    start: float


@dataclass(frozen=True)
class CameraVideo:
    """One camera's video.

    Attributes:
        file: MP4, MOV, Matroska, WebM or AVI.
        camera: its name, for messages.
    """

    file: Path
    camera: str

    def facts(self) -> IndexFacts:
        """Of its index, read once."""
        check_regular(self.file, _REMEDY, place=f"camera {self.camera}", missing="a video is missing")
        return _facts(self, self.file.stat().st_mtime_ns)

    def frames(
        self, indices: Sequence[int], channels: Channels, threads: int = 1, fine: bool = True
    ) -> Iterator[Image]:
        """Some of its frames, decoded in one go; all before the last one are decoded.

        Colours are those of the file's tags, BT.601 where it has none, as FFmpeg and OpenCV take them.

        Args:
            indices: positions, increasing.
            channels: "rgb" (H, W, 3) or "opacity" (H, W, 1), of a video that shows opacity as grey.
            threads: of the decoder; 0 lets it choose.
            fine: interpolate chroma, which is stored at half the resolution. It takes as long as decoding; a picture
                that is averaged down to half its size is none the better for it (45 dB without, 39 with, of noise).
        """
        wanted, size = iter(indices), self.facts().size
        following, position = next(wanted, None), 0
        if following is None:
            return
        with _opened(self) as (container, stream):
            stream.codec_context.thread_count = threads
            stream.thread_type = "AUTO"
            reformatter = VideoReformatter()
            try:
                for frame in container.decode(stream):
                    if frame.is_corrupt:
                        raise self.damaged(position, "a damaged frame")
                    if (frame.width, frame.height) != size:
                        found = f"{frame.width} x {frame.height} pixels, not {size[0]} x {size[1]}"
                        raise self.damaged(position, found)
                    if position == following:
                        yield _pixels(frame, reformatter, channels, _FINE if fine else Interpolation.BICUBIC)
                        following = next(wanted, None)
                        if following is None:
                            return
                    position += 1
            except FFmpegError as error:
                raise self.damaged(position, str(error)) from None
        raise self.damaged(position, f"only {position} frames can be decoded")

    def damaged(self, position: int, found: str) -> UserError:
        """The error for a frame that cannot be had."""
        expected = f"{self.facts().count} frames, as its index says"
        remedy = _REMEDY + "; `frames: {stop: N}` uses the first N frames only"
        return self.refused("a damaged video", expected, found, remedy, position)

    def refused(
        self, message: str, expected: str, found: str, remedy: str = _REMEDY, frame: int | None = None
    ) -> UserError:
        """The error for something that its index says."""
        place = f"camera {self.camera}" + ("" if frame is None else f", frame {frame}")
        return UserError(message, file=self.file, place=place, expected=expected, found=found, remedy=remedy)


def check_together(videos: Sequence[CameraVideo], most: int | None = None) -> tuple[int, Fraction]:
    """Number of frames and frames a second that all videos of a capture have in common.

    Args:
        most: only so many frames are used; None for all.
    """
    facts = [video.facts() for video in videos]
    rates = [one.rate for one in facts]
    rate = max(set(rates), key=rates.count)
    starts = [one.start for one in facts]
    start = float(np.median(starts))
    counts = [one.count for one in facts]
    count = max(set(counts), key=counts.count)
    for video, one in zip(videos, facts, strict=True):
        if abs(one.rate / rate - 1) > Fraction(1, 1000):
            expected, found = f"{float(rate):.6g} frames a second, as the others", f"{float(one.rate):.6g}"
            raise video.refused("videos of different frame rates", expected, found)
        if abs(one.start - start) * float(rate) > 0.5:
            raise video.refused(
                "a camera with a time offset",
                f"a video that begins at {start:.4g} s, as the others",
                f"{one.start:.4g} s: its frames show other moments",
                "cut the videos so that all begin at the same moment, or take this camera out of the capture",
            )
        if one.count != count and (most is None or one.count < most):
            raise video.refused(
                "videos of different lengths",
                f"{count} frames, as most of the others",
                f"{one.count} frames: frames may be missing anywhere, so that the cameras show other moments",
                f"copy it again; if only its end is missing, set `frames: {{stop: {min(counts)}}}` of this subject",
            )
    return min(counts), rate


@contextmanager
def _opened(video: CameraVideo) -> Iterator[tuple[Any, Any]]:
    """(container, its video stream); errors of FFmpeg while it is opened are the user's."""
    kind = CONTAINERS.get(video.file.suffix.lower())
    if kind is None:
        raise video.refused("a video of a kind that is not read", f"one of {', '.join(CONTAINERS)}", video.file.suffix)
    try:
        container = av.open(
            f"file:{video.file}", format=kind, container_options=STRICT, stream_options=cast(Any, [STRICT])
        )
    except (FFmpegError, ValueError) as error:
        found = f"{error}: cut off, or no video ({video.file.stat().st_size} bytes)"
        raise video.refused("cannot read a video", "a whole video", found) from None
    with container:
        if not container.streams.video or container.streams.video[0].codec_context is None:
            raise video.refused("cannot read a video", "a video stream of a known codec", "none")
        yield container, container.streams.video[0]


@lru_cache(maxsize=1024)
def _facts(video: CameraVideo, _changed: int) -> IndexFacts:
    with _opened(video) as (container, stream):
        _check_turn(video, container, stream)
        times, end = _index(video, container, stream)
        length = video.file.stat().st_size
        if end > length:
            raise video.refused("a video is cut off", f"{end} bytes, as its index says", f"{length} bytes")
        if not times:
            raise video.refused("a video without frames", "at least one frame", "none")
        base = Fraction(stream.time_base)
        steps = np.diff(np.array(times, np.float64))
        step = Fraction(times[-1] - times[0], len(times) - 1) if len(times) > 1 else Fraction(0)
        odd = np.flatnonzero(np.abs(steps - float(step)) > np.maximum(0.1 * float(step), 1.0))
        if len(odd) or (len(times) > 1 and step <= 0):
            first = int(odd[0]) if len(odd) else 0
            raise video.refused(
                "a video of a variable frame rate",
                f"a frame every {float(step * base) * 1000:.4g} ms",
                f"{float(int(steps[first]) * base) * 1000:.4g} ms between frames {first} and {first + 1}",
                "export it at a constant rate, each frame that the camera took once",
                first + 1,
            )
        rate = 1 / (step * base) if step else Fraction(stream.average_rate or 1)
        rate = rate.limit_denominator(1001)
        context = stream.codec_context
        start = stream.start_time if stream.start_time is not None else times[0]
        return IndexFacts((context.width, context.height), len(times), rate, float(start * base))


def _index(video: CameraVideo, container: Any, stream: Any) -> tuple[list[int], int]:
    """Times of all frames, in order, in units of the stream's time base, and where the last one's bytes end.

    MP4 has a table of all frames; of other containers, all packets are read.
    """
    if CONTAINERS[video.file.suffix.lower()] == "mov":
        entries = [entry for entry in stream.index_entries if not entry.flags & _DISCARDED]
        return [entry.timestamp for entry in entries], max((entry.pos + entry.size for entry in entries), default=0)
    try:
        packets = [packet for packet in container.demux(stream) if packet.size]
    except FFmpegError as error:
        raise video.refused("cannot read a video", "a whole video", str(error)) from None
    if any(packet.pts is None for packet in packets):
        return list(range(len(packets))), 0  # AVI keeps no times of pictures that are shown in another order
    return sorted(packet.pts for packet in packets), 0


def _check_turn(video: CameraVideo, container: Any, stream: Any) -> None:
    """Refuse a tag that turns the picture: K and width and height refer to what is stored, players show another."""
    stream.codec_context.thread_count = 1
    try:
        packet = next(container.demux(stream))
        frame = [*stream.codec_context.decode(packet), *stream.codec_context.decode(None)][0]
    except (FFmpegError, StopIteration, IndexError) as error:
        raise video.refused("a damaged video", "a first frame", str(error) or "none", frame=0) from None
    finally:
        container.seek(0)
    if frame.rotation % 360:
        raise video.refused(
            "a video with a tag that turns it",
            "pictures stored upright, without a rotation tag",
            f"turned by {frame.rotation} degrees",
            "take the tag off (`ffmpeg -display_rotation 0 -i IN -c copy OUT`) if the calibration is for the "
            "pictures as stored; else encode them turned",
        )


def _pixels(frame: Any, reformatter: VideoReformatter, channels: Channels, how: Interpolation) -> Image:
    """(H, W, 3) RGB, or (H, W, 1) of a grey one: its green channel, full range."""
    converted = reformatter.reformat(frame, format="rgb24", interpolation=how)
    plane = converted.planes[0]  # its rows are padded: seen in place, for copying costs as much as converting
    rows: Image = np.frombuffer(memoryview(plane), np.uint8).reshape(-1, plane.line_size)[: converted.height]
    rgb = rows[:, : 3 * converted.width].reshape(converted.height, converted.width, 3)
    return rgb if channels == "rgb" else np.ascontiguousarray(rgb[..., 1:2])
