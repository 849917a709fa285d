"""Regions of a picture that an encoder may code finer or coarser than the rest, marked on the frames by FFmpeg.

PyAV has no way to write a frame's side data; FFmpeg's filter `addroi` has, a region at a time. Encoders that do not
know regions pass over them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import av
from av.filter import Graph

QUANTISERS = 51
"""Steps of H.264's quantiser, by which FFmpeg counts a region's offset as a fraction."""


@dataclass(frozen=True)
class Region:
    """A rectangle in pixels.

    Attributes:
        x, y, width, height: of the picture, from its top left corner.
        offset: steps of H.264's quantiser (six of them double it); negative is finer.
    """

    x: int
    y: int
    width: int
    height: int
    offset: int


class Marker:
    """Puts regions on frames, the same on all.

    Args:
        size: (width, height) of the frames, planar 4:2:0.
        rate: frames a second.
        regions: where they overlap, any of them may count.
    """

    def __init__(self, size: tuple[int, int], rate: Fraction, regions: Sequence[Region]) -> None:
        graph = Graph()
        pixels: Any = "yuv420p"  # PyAV's stubs want an object, and its code takes a name
        source = graph.add_buffer(width=size[0], height=size[1], format=pixels, time_base=1 / rate)
        last: Any = source
        for region in regions:
            place = f"x={region.x}:y={region.y}:w={region.width}:h={region.height}"
            marked = graph.add("addroi", f"{place}:qoffset={region.offset}/{QUANTISERS}")
            last.link_to(marked)
            last = marked
        sink = graph.add("buffersink")
        last.link_to(sink)
        graph.configure()
        self._graph, self._source, self._sink = graph, source, sink
        self._marked: Any = None

    def __call__(self, frame: av.VideoFrame) -> Any:
        """The same picture with the regions on it, valid until the next: one frame, marked once, takes all pictures.

        Thousands of regions cost a second a frame, so it is marked once; and x264 copies what it is given.
        """
        if self._marked is None:
            self._source.push(frame)
            self._marked = self._sink.pull()
            return self._marked
        for plane, picture in zip(self._marked.planes, frame.planes, strict=True):
            plane.update(picture)
        self._marked.pts, self._marked.time_base = frame.pts, frame.time_base
        return self._marked
