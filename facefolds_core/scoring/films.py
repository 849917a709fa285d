"""Films of held-out cameras, truth and asset side by side: every frame that is scored, to be looked at."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
from av.video.reformatter import ColorRange, Colorspace

from facefolds_core.asset.colour import rgb_to_yuv420
from facefolds_core.errors import UserError
from facefolds_core.files.reading import remake
from facefolds_core.files.writing import read_json
from facefolds_core.scoring.metrics import Array

FILMS = "films.json"
CRF = 18
"""Constant rate factor of libx264: smaller is finer."""
NAME = re.compile(r"films/[0-9]+\.mp4")


@dataclass(frozen=True)
class FilmFile:
    """A film of one camera.

    Attributes:
        camera: its name.
        file: within the folder of the evaluation.
        fps: pictures a second.
        frames: names of its frames in the capture, in order.
    """

    camera: str
    file: str
    fps: float
    frames: tuple[str, ...]


def read_films(folder: Path) -> list[FilmFile]:
    """What `evaluate` lists in `films.json`; nothing where that is not there.

    Raises:
        UserError: if it is garbled, or names other files than films of an evaluation.
    """
    path = folder / FILMS
    if not path.is_file():
        return []
    try:
        films = [FilmFile(**one) for one in read_json(path)]
        if not all(NAME.fullmatch(film.file) for film in films):
            raise ValueError("a file that is no film of an evaluation")
    except (TypeError, ValueError) as error:
        raise UserError("a garbled list of films", file=path, found=str(error), remedy=remake(path)) from None
    return films


class FilmRoll:
    """Writes one camera's film, picture by picture."""

    def __init__(self, path: Path, fps: Fraction) -> None:
        self.frames: list[str] = []
        self._path, self._fps = path, fps
        self._first: tuple[Array, Array] = (np.zeros((0, 0, 3)), np.zeros((0, 0, 3)))
        self._container: Any = None
        self._stream: Any = None

    def add(self, frame: str, truth: Array, asset: Array) -> None:
        """Args: `frame` its name; truth, asset (H, W, 3) in [0, 1]."""
        self.frames.append(frame)
        if len(self.frames) == 1:  # a single frame is no film: it waits for the second
            self._first = (truth, asset)
            return
        if self._container is None:
            self._write(0, *self._first)
        self._write(len(self.frames) - 1, truth, asset)

    def _write(self, position: int, truth: Array, asset: Array) -> None:
        both = np.concatenate([truth, asset], 1)
        both = np.pad(both, ((0, -both.shape[0] % 4), (0, 0), (0, 0)), mode="edge")  # planes of whole rows
        if self._container is None:
            self._open(both.shape[1], both.shape[0])
        planes = rgb_to_yuv420(np.rint(255 * np.clip(both, 0, 1)).astype(np.uint8))
        picture = np.concatenate([plane.ravel() for plane in planes]).reshape(-1, both.shape[1])
        video = av.VideoFrame.from_ndarray(picture, format="yuv420p")
        video.colorspace, video.color_range = Colorspace.ITU709, ColorRange.MPEG
        video.pts, video.time_base = position, 1 / self._fps
        self._container.mux(self._stream.encode(video))

    def _open(self, width: int, height: int) -> None:
        muxer = {"fflags": "bitexact", "movflags": "faststart"}
        options = {"crf": str(CRF), "x264-params": "chromaloc=1"}  # where rgb_to_yuv420 puts chroma: the centre
        self._container = av.open(str(self._path), "w", format="mp4", options=muxer)
        self._stream = self._container.add_stream("libx264", rate=self._fps, options=options)
        self._stream.width, self._stream.height, self._stream.pix_fmt = width, height, "yuv420p"
        self._stream.codec_context.time_base = 1 / self._fps
        self._stream.codec_context.thread_count = 1

    def close(self) -> None:
        if self._container is not None:
            self._container.mux(self._stream.encode(None))
            self._container.close()


class FilmFolder:
    """Films of some cameras in one folder.

    Args:
        folder: of the evaluation; None writes nothing.
        fps: 0 for a scene of one frame, of which there is no film.
    """

    def __init__(self, folder: Path | None, fps: float) -> None:
        self._folder = folder if fps > 0 else None
        self._fps = Fraction(fps).limit_denominator(1001)
        self.files: list[FilmFile] = []

    @contextmanager
    def roll(self, camera: str) -> Iterator[FilmRoll | None]:
        """For one camera's pictures; None where nothing is written."""
        if self._folder is None:
            yield None
            return
        (self._folder / "films").mkdir(exist_ok=True)
        name = f"films/{len(self.files):03d}.mp4"
        roll = FilmRoll(self._folder / name, self._fps)
        try:
            yield roll
        finally:
            roll.close()
        if len(roll.frames) > 1:
            self.files.append(FilmFile(camera, name, float(self._fps), tuple(roll.frames)))
