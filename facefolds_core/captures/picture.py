"""One picture of a capture, wherever it lies: a file, bytes inside a zip or an HDF5 file, a frame of a video.

Readers say where pictures lie (`Picture`), `normalize` asks for their sizes without decoding them, then for their
pixels. Frames of videos are decoded in order (`developing`): a video is read once.
"""

from __future__ import annotations

import zipfile
import zlib
from abc import ABC, abstractmethod
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, ClassVar, Protocol

import h5py
import numpy as np

from facefolds_core.captures.images import REMEDY, Image, opacity_of, rgb_of, unreadable
from facefolds_core.captures.videos import CameraVideo
from facefolds_core.errors import UserError
from facefolds_core.files.pictures import FORMATS, DamagedPictureError, picture_size
from facefolds_core.files.reading import LARGEST, check_regular, read_bytes

_REMEDY = "copy the file again from its source, or take this camera out of the capture"
_MISSING = "an image is missing"
_HEAD = 1 << 16
"""Bytes that hold the header of any picture that a camera or an encoder writes."""


class Picture(Protocol):
    """One picture. `place` is camera and frame in words, for messages; every method raises `UserError` with them."""

    @property
    def file(self) -> Path:
        """The file that it lies in."""

    def size(self, place: str) -> tuple[int, int]:
        """(width, height), from a header: pixels are not decoded."""

    def rgb(self, place: str) -> Image:
        """(H, W, 3) uint8."""

    def opacity(self, place: str) -> Image:
        """(H, W, 1) uint8 of a picture that is a mask: 255 is the subject."""


@dataclass(frozen=True)
class FilePicture:
    """A PNG or JPEG file."""

    file: Path

    def size(self, place: str) -> tuple[int, int]:
        length = check_regular(self.file, REMEDY, place=place, missing=_MISSING, largest=LARGEST)
        try:
            return picture_size(self.file)
        except (OSError, DamagedPictureError) as error:
            raise unreadable(self.file, place, length, error) from None

    def rgb(self, place: str) -> Image:
        return rgb_of(read_bytes(self.file, REMEDY, place=place, missing=_MISSING), self.file, place)

    def opacity(self, place: str) -> Image:
        return opacity_of(read_bytes(self.file, REMEDY, place=place, missing=_MISSING), self.file, place)


@dataclass(frozen=True)
class _Stored(ABC):
    """An encoded picture inside a file of many.

    Attributes:
        file: that it lies in.
        name: its own in there.
        formats: what it may be.
    """

    file: Path
    name: str
    formats: tuple[str, ...] = FORMATS
    largest: ClassVar[bool] = False
    """Whether of a coloured mask the largest channel counts."""

    def size(self, place: str) -> tuple[int, int]:
        """From its first bytes, or from all of them where its header is longer."""
        with suppress(OSError, DamagedPictureError):
            return picture_size(self._bytes(place, _HEAD), self.formats)
        try:
            return picture_size(self._bytes(place), self.formats)
        except (OSError, DamagedPictureError) as error:
            raise _wrong(self.file, self._at(place), "cannot read an image", str(error)) from None

    def rgb(self, place: str) -> Image:
        return rgb_of(self._bytes(place), self.file, self._at(place), self.formats)

    def opacity(self, place: str) -> Image:
        return opacity_of(self._bytes(place), self.file, self._at(place), self.formats, largest=self.largest)

    def _at(self, place: str) -> str:
        return f"{place} ({self.name})"

    @abstractmethod
    def _bytes(self, place: str, most: int | None = None) -> bytes:
        """All, or the first `most`."""


class ZipPicture(_Stored):
    """A member of a zip archive."""

    def _bytes(self, place: str, most: int | None = None) -> bytes:
        return read_member(self.file, self.name, self._at(place), -1 if most is None else most)


class Hdf5Picture(_Stored):
    """A data set of bytes in an HDF5 file."""

    largest = True

    def _bytes(self, place: str, most: int | None = None) -> bytes:
        try:
            value = open_hdf5(self.file)[self.name]
            part = (
                slice(most) if isinstance(value, h5py.Dataset) and value.shape[:1] and value.dtype.itemsize == 1 else ()
            )
            data = value[part] if isinstance(value, h5py.Dataset) else None
        except (OSError, KeyError, ValueError, RuntimeError) as error:
            raise _wrong(self.file, self._at(place), "cannot read an image", str(error)) from None
        if data is None or np.asarray(data).dtype.kind not in "uiSV":
            raise _wrong(self.file, self._at(place), "cannot read an image", "a data set that is no bytes")
        return np.asarray(data).tobytes()


@dataclass(frozen=True)
class VideoFrame:
    """A frame of a video. `CameraVideo.frames` reads many in one go; by itself, all before it are decoded, too.

    Attributes:
        video: whose.
        index: its position, from 0.
    """

    video: CameraVideo
    index: int

    @property
    def file(self) -> Path:
        return self.video.file

    def size(self, place: str) -> tuple[int, int]:
        return self.video.facts().size

    def rgb(self, place: str) -> Image:
        return next(self.video.frames([self.index], "rgb"))

    def opacity(self, place: str) -> Image:
        return next(self.video.frames([self.index], "opacity"))


def _wrong(file: Path, place: str | None, message: str, found: str) -> UserError:
    return UserError(message, file=file, place=place, found=found, remedy=_REMEDY)


_DAMAGE = (zipfile.BadZipFile, zlib.error, OSError, EOFError, RuntimeError, ValueError, NotImplementedError)


def read_member(file: Path, member: str, place: str | None = None, most: int = -1) -> bytes:
    """Bytes of a member of a zip archive: all, with its checksum, or the first `most`."""
    try:
        with open_zip(file).open(member) as stream:
            return stream.read(most)
    except KeyError:
        raise _wrong(file, place, "an image is missing", f"no {member} in the archive") from None
    except _DAMAGE as error:
        raise _wrong(file, place, "a damaged zip archive", str(error) or type(error).__name__) from None


def open_zip(file: Path) -> zipfile.ZipFile:
    """An archive, opened once; threads may share it. Raises `UserError` if it is missing, or none."""
    archive: zipfile.ZipFile = _open("zip archive", file)
    return archive


def open_hdf5(file: Path) -> h5py.File:
    """An HDF5 file, likewise."""
    return _open("HDF5 file", file)


def _open(kind: str, file: Path) -> Any:
    check_regular(file, _REMEDY)
    return _opened(kind, file, file.stat().st_mtime_ns)


@lru_cache(maxsize=256)
def _opened(kind: str, file: Path, _changed: int) -> Any:
    try:
        return zipfile.ZipFile(file) if kind == "zip archive" else h5py.File(file, "r")
    except _DAMAGE as error:
        raise _wrong(file, None, f"a damaged {kind}", str(error) or type(error).__name__) from None
