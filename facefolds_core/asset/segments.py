"""Videos in segments: each is read, checked and decoded by itself, with the file's header before it."""

from __future__ import annotations

from collections.abc import Iterator
from io import BytesIO
from itertools import accumulate, pairwise
from pathlib import Path

from facefolds_core.asset.manifest import REMEDY, Texture, Video
from facefolds_core.asset.stored import read_slice
from facefolds_core.asset.video import Picture, VideoFacts, decode_video, probe_video
from facefolds_core.errors import UserError


def starts(video: Video) -> list[int]:
    """Numbers of the frames that the segments begin with, and that after the last."""
    return list(accumulate((segment.frames for segment in video.segments or ()), initial=0))


def segment_problems(video: Video, texture: Texture) -> list[str]:
    """What is wrong with the places and lengths of a video's segments, in words."""
    if video.init is None and video.segments is None:
        return []
    if video.init is None or video.segments is None or video.container != "mp4":
        return ["init and segments come together, in MP4"]
    problems = []
    parts = [video.init, *video.segments]
    ends = [part.offset + part.bytes for part in parts]
    if video.init.offset or any(end != after.offset for end, after in zip(ends, parts[1:], strict=False)):
        problems.append("its header and segments do not follow each other")
    if ends[-1] > video.bytes:
        problems.append("its segments are not inside the file")
    places = starts(video)
    if places[-1] != texture.frames:
        problems.append(f"its segments hold {places[-1]} frames of {texture.frames}")
    if not set(places[:-1]) <= set(texture.keyframes):
        problems.append("its segments do not begin with keyframes")
    return problems


def decode_segments(folder: Path, video: Video, texture: Texture, start: int = 0) -> Iterator[Picture]:
    """The pictures from frame `start` on; one segment at a time is in memory.

    Raises:
        UserError: if a segment is not the manifest's, or damaged, or a frame is missing.
    """
    path, size = folder / video.file, (texture.width, texture.height)
    for index, (first, after) in enumerate(pairwise(starts(video))):
        if after <= start:
            continue
        wanted, count = max(start, first), 0
        for picture in decode_video(path, size, texture.fps, wanted, _part(folder, video, index)):
            count += 1
            yield picture
        if count != after - wanted:
            found = f"{count} frames of segment {index}, the manifest says {after - wanted}"
            raise UserError("damaged texture video", file=path, found=found, remedy=REMEDY)


def probe_segments(folder: Path, video: Video, texture: Texture) -> VideoFacts:
    """As `probe_video`, of a video in segments."""
    return probe_video(folder / video.file, _part(folder, video, 0), texture.rate, texture.frames)


def _part(folder: Path, video: Video, index: int) -> BytesIO:
    """The header and a segment, checked."""
    assert video.init is not None and video.segments is not None
    path, parts = folder / video.file, (video.init, video.segments[index])
    return BytesIO(b"".join(read_slice(path, part.offset, part.bytes, part.sha256) for part in parts))
