"""Levels of a long take as streams: fragmented MP4 (CMAF) with a DASH manifest and HLS playlists, by FFmpeg's muxer.

The videos have been encoded as any level's: their groups of pictures are closed and of one length. Here each group
becomes a segment; nothing is encoded again. Each video stays one file, of which players fetch byte ranges.
"""

from __future__ import annotations

import hashlib
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from fractions import Fraction
from heapq import merge
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import av

from facefolds_core.asset.containers import container_of
from facefolds_core.asset.manifest import Level, Segment, Texture, Video
from facefolds_core.asset.manifest_base import ByteRange
from facefolds_core.asset.manifest_extras import Audio, Stream
from facefolds_core.asset.segments import probe_segments
from facefolds_core.asset.stored import stored_file
from facefolds_core.asset.video import FORMATS

DASH, HLS = "stream.mpd", "stream.m3u8"
_NAMESPACE = {"mpd": "urn:mpeg:dash:schema:mpd:2011"}
_TIMES_OF_WRITING = re.compile(r"#EXT-X-PROGRAM-DATE-TIME:.*\n")


@dataclass(frozen=True)
class StreamSource:
    """What becomes one stream: a file with one track, its place among the tracks, and the name of the new file."""

    source: Path
    index: int
    name: str
    group: str

    @property
    def playlist(self) -> str:
        return f"{Path(self.name).stem}.m3u8"


def make_streams(
    folder: Path, levels: Sequence[Level], audio: Audio | None
) -> tuple[list[Level], Audio | None, Stream]:
    """Turn the videos of levels, and the sound, that lie in `folder` into streams; the files that were there go.

    Args:
        levels: coarsest first, with key frames that are all the same.

    Returns:
        the levels and the sound with their new files, and what leads to them.
    """
    videos = [(level, video) for level in levels for video in level.texture.videos]
    tracks = [
        StreamSource(folder / video.file, index, _name(level, video), f"{level.switchable or level.name} {video.codec}")
        for index, (level, video) in enumerate(videos)
    ]
    if audio is not None:
        tracks.append(StreamSource(folder / audio.file, len(tracks), "audio.mp4", "audio"))
    texture = levels[-1].texture
    with TemporaryDirectory(dir=folder) as scratch:
        ranges = _mux(Path(scratch), tracks, texture)
        for track in tracks:
            track.source.unlink()
        written = [track.name for track in tracks] + [track.playlist for track in tracks] + [DASH, HLS]
        for name in written:
            (Path(scratch) / name).replace(folder / name)
    made = {
        (level.name, video.file): _segmented(folder, track.name, video, level.texture, ranges[track.index])
        for track, (level, video) in zip(tracks, videos, strict=False)
    }
    streamed = [
        _with_videos(level, [made[level.name, video.file] for video in level.texture.videos]) for level in levels
    ]
    sound = None if audio is None else audio.model_copy(update=stored_file(folder / "audio.mp4").model_dump())
    playlists = tuple(stored_file(folder / name) for name in [HLS, *(track.playlist for track in tracks)])
    return streamed, sound, Stream(dash=stored_file(folder / DASH), hls=playlists)


def _name(level: Level, video: Video) -> str:
    """Another codec's file than the first has its name."""
    first = level.texture.videos[0].codec == video.codec
    return f"{level.name}.mp4" if first else f"{level.name}_{video.codec}.mp4"


def _mux(folder: Path, tracks: Sequence[StreamSource], texture: Texture) -> dict[int, list[tuple[int, int]]]:
    """Write all tracks' files, the DASH manifest and the playlists; returns (first, last byte) of each part of each."""
    groups = dict.fromkeys(track.group for track in tracks)
    sets = [",".join(str(track.index) for track in tracks if track.group == group) for group in groups]
    frames = texture.keyframes[1] if len(texture.keyframes) > 1 else texture.frames
    options = {
        "single_file": "1",
        "single_file_name": "track_$RepresentationID$.mp4",
        "use_template": "0",
        "use_timeline": "0",
        "dash_segment_type": "mp4",
        "seg_duration": f"{(frames / texture.rate * 1_000_000).__floor__()}us",
        "adaptation_sets": " ".join(f"id={index},streams={members}" for index, members in enumerate(sets)),
        "hls_playlist": "1",
        "hls_master_name": HLS,
        "fflags": "bitexact",
    }
    with av.open(str(folder / DASH), "w", format="dash", options=options) as out:
        copy_packets(out, [track.source for track in tracks], texture.rate)
    names = {f"track_{track.index}.mp4": track.name for track in tracks}
    names |= {f"media_{track.index}.m3u8": track.playlist for track in tracks}
    for old, new in names.items():
        (folder / old).replace(folder / new)
    for path in (folder / DASH, folder / HLS, *(folder / track.playlist for track in tracks)):
        text = _TIMES_OF_WRITING.sub("", path.read_text())
        path.write_text(re.sub(r"(?:track|media)_\d+\.\w+", lambda found: names[found[0]], text))
    return _ranges((folder / DASH).read_text())


def copy_packets(out: Any, files: Sequence[Path], rate: Fraction) -> None:
    """The packets of files with one track each, by their times; pictures are numbered, whatever a container rounded.

    Args:
        out: PyAV's container.
        rate: pictures a second.
    """
    with ExitStack() as opened:
        sources = [opened.enter_context(av.open(f"file:{one}", format=FORMATS[container_of(one)])) for one in files]
        copies = [out.add_stream_from_template(source.streams[0], opaque=True) for source in sources]
        for copy in copies:
            if copy.type == "video":
                copy.time_base = 1 / rate  # WebM's milliseconds would end segments a frame late
        queues = [_packets(source, copy, rate) for source, copy in zip(sources, copies, strict=True)]
        for _, _, packet in merge(*queues, key=lambda entry: entry[:2]):
            out.mux(packet)


def _packets(source: Any, copy: Any, rate: Fraction) -> Iterator[tuple[Fraction, int, Any]]:
    for number, packet in enumerate(packet for packet in source.demux(source.streams[0]) if packet.size):
        if copy.type == "video":
            packet.time_base, packet.pts, packet.dts, packet.duration = 1 / rate, number, number, 1
        packet.stream = copy
        yield packet.dts * packet.time_base, copy.index, packet


def _ranges(text: str) -> dict[int, list[tuple[int, int]]]:
    """Of a DASH manifest that we wrote: number of the track -> first and last bytes of its header and its segments."""
    found = {}
    for representation in ElementTree.fromstring(text).iterfind(".//mpd:Representation", _NAMESPACE):
        header = representation.find(".//mpd:Initialization", _NAMESPACE)
        parts = representation.findall(".//mpd:SegmentURL", _NAMESPACE)
        assert header is not None
        said = [header.attrib["range"], *(part.attrib["mediaRange"] for part in parts)]
        pairs = (each.split("-") for each in said)
        found[int(representation.attrib["id"])] = [(int(first), int(last)) for first, last in pairs]
    return found


def _segmented(folder: Path, name: str, video: Video, texture: Texture, ranges: list[tuple[int, int]]) -> Video:
    path, places = folder / name, [*texture.keyframes, texture.frames]
    with path.open("rb") as file:
        parts: list[dict[str, Any]] = []
        for first, last in ranges:
            file.seek(first)
            data = file.read(last + 1 - first)
            parts.append({"offset": first, "bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()})
    frames = [after - first for first, after in pairwise(places)]
    segments = tuple(Segment(**part, frames=count) for part, count in zip(parts[1:], frames, strict=True))
    update = {**stored_file(path).model_dump(), "container": "mp4", "init": ByteRange(**parts[0]), "segments": segments}
    made = video.model_copy(update=update)
    facts = probe_segments(folder, made, texture)
    return made.model_copy(update={"mime": facts.mime, "level": facts.level})


def _with_videos(level: Level, videos: Sequence[Video]) -> Level:
    more = sum(video.bytes for video in videos) - sum(video.bytes for video in level.texture.videos)
    texture = level.texture.model_copy(update={"videos": tuple(videos)})
    return level.model_copy(update={"texture": texture, "bytes": level.bytes + more})
