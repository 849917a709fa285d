"""What manifest.json of an asset says, format version 4 (docs/reference/asset-format.md), as validated models.

`manifest_file.py` reads and writes the file, and makes the JSON schema beside it.
"""

from __future__ import annotations

import json
from fractions import Fraction
from typing import Annotated, Literal

from pydantic import Field

from facefolds_core.asset.codecs import CodecName
from facefolds_core.asset.manifest_base import (
    UV,
    ByteRange,
    Count,
    ExtensionName,
    FileName,
    Maybe,
    Name,
    Offset,
    Part,
    RateTerm,
    Rect,
    Scale,
    Sha256,
    StoredFile,
    Vector,
)
from facefolds_core.asset.manifest_extras import Audio, FilmedView, Photo, Picture, Poster, StandingTorso, Stream
from facefolds_core.geometry.similarity import Similarity

FORMAT_VERSION, LEAST_VERSION = 4, 3
"""What is written, and the oldest version whose readers show such assets right; `Manifest` has both as literals."""
REMEDY = "make the asset again (`dvc repro`), or copy it again from where it is whole"

UNSEALED = "0" * 64
"""Stands for the manifest's own SHA-256 while that is computed."""


class Transform(Part):
    """x -> scale * rotation @ x + translation; rotation by rows."""

    scale: Annotated[float, Field(gt=0)]
    rotation: tuple[Vector, Vector, Vector]
    translation: Vector

    @classmethod
    def of(cls, similarity: Similarity) -> Transform:
        return cls.model_validate_json(json.dumps(similarity.to_json()))


class Coordinates(Part):
    """Axes and units of the meshes, and the way back to the capture."""

    handedness: Literal["right"] = "right"
    forward: Literal["+x"] = "+x"
    up: Literal["+z"] = "+z"
    units: Literal["normalised"] = "normalised"
    to_capture: Transform
    sphere_centre: Vector


class Layer(Part):
    """One mesh and its place in the video.

    Attributes:
        texture_rect: of its colour, within the colour image; its alpha has the same place within the alpha image.
        uv_window: (u0, u1, v0, v1), what its texture covers of the UV map.
        mesh, offset, bytes, sha256: the file among the level's `meshes`, and the bytes in it that are this Draco mesh.
    """

    mesh: FileName
    offset: Offset
    vertices: Count
    triangles: Count
    bytes: Count
    sha256: Sha256
    texture_rect: Rect
    uv_window: tuple[UV, UV, UV, UV]


class Segment(ByteRange):
    """A closed group of pictures: `frames` of them, from where the segment before ends."""

    frames: Count


class Video(StoredFile):
    """One encoding of the textures' pictures.

    Attributes:
        mime: MIME type with codec string, as browsers take it.
        level: of the codec, that a decoder must support.
        init: of a video in segments, its header.
        segments: of a video that is to be fetched by parts; each can be decoded with the header alone.
    """

    container: Literal["mp4", "webm"]
    codec: CodecName
    mime: str
    level: Annotated[str, Field(pattern=r"^[1-7](\.[0-3])?$")]
    pixel_format: Literal["yuv420p"] = "yuv420p"
    init: Maybe[ByteRange] = None
    segments: Maybe[Annotated[tuple[Segment, ...], Field(min_length=1)]] = None


class Bounds(Part):
    """Corners of the box around all vertices of all levels, in the meshes' own frame."""

    min: Vector
    max: Vector


class Texture(Part):
    """The textures of a level: pictures, encoded once or in several ways.

    Attributes:
        width, height: of the decoded picture.
        colour_rect, alpha_rect: in pixels of the decoded picture; of one size.
        frame_rate: numerator and denominator of the frames a second.
        keyframes: the numbers of the frames that can be decoded without the ones before, in order.
        videos: the same pictures; a player takes the first that it can decode.
    """

    width: Count
    height: Count
    colour_rect: Rect
    alpha_rect: Rect
    frames: Count
    frame_rate: tuple[RateTerm, RateTerm]
    keyframes: Annotated[tuple[Offset, ...], Field(min_length=1)]
    colour_space: Literal["bt709"] = "bt709"
    colour_range: Literal["tv"] = "tv"
    chroma_location: Literal["center"] = "center"
    videos: Annotated[tuple[Video, ...], Field(min_length=1)]

    @property
    def rate(self) -> Fraction:
        """Frames a second."""
        return Fraction(*self.frame_rate)

    @property
    def fps(self) -> float:
        """Frames a second."""
        return float(self.rate)


class Reflection(StoredFile):
    """What gloss adds to the colours by the direction; players may ignore it.

    Attributes:
        width, height: of the PNG.
        uv_window: (u0, u1, v0, v1), what gloss, offset and normals cover of the UV map.
        environment_rect, gloss_rect, offset_rect, normals_rect: in pixels of the PNG.
        environment_scale, gloss_scale, offset_scale: what code 255 means; code 0 means 0, in the offset -offset_scale.
    """

    width: Count
    height: Count
    uv_window: tuple[UV, UV, UV, UV]
    environment_rect: Rect
    gloss_rect: Rect
    offset_rect: Rect
    normals_rect: Rect
    environment_scale: Scale
    gloss_scale: Scale
    offset_scale: Scale

    def rects(self) -> tuple[Rect, Rect, Rect, Rect]:
        """Of environment, gloss, offset and normals."""
        return self.environment_rect, self.gloss_rect, self.offset_rect, self.normals_rect


class Quality(Part):
    """How near the level is to what was trained.

    Attributes:
        psnr_to_model: of training views rendered from this level, against the textures and meshes before coding, dB.
        target_psnr: what the encoder was asked for; it may be out of reach.
    """

    psnr_to_model: float
    target_psnr: Maybe[float] = None


class Level(Part):
    """One level of detail, complete in itself.

    Attributes:
        layers: outermost first; their number may differ between levels.
        reflection: what gloss adds; absent where there is none.
        bytes: of all its files.
        meshes: the files that the layers' meshes are bytes of, usually one.
        switchable: levels of the same name here differ in nothing but their videos and the size of these.
    """

    name: Name
    switchable: Maybe[Name] = None
    meshes: Annotated[tuple[StoredFile, ...], Field(min_length=1)]
    layers: Annotated[tuple[Layer, ...], Field(min_length=1)]
    texture: Texture
    reflection: Maybe[Reflection] = None
    bytes: Count
    quality: Quality | None = None

    def files(self) -> list[tuple[str, int, str]]:
        """(name, bytes, sha256) of each of its files, the meshes first."""
        files: list[StoredFile] = [*self.meshes, *self.texture.videos]
        files += [] if self.reflection is None else [self.reflection]
        return [(entry.file, entry.bytes, entry.sha256) for entry in files]


class Compositing(Part):
    """How the layers are put together."""

    order: Literal["outermost first"] = "outermost first"
    alpha: Literal["straight"] = "straight"
    transfer: Literal["as stored (sRGB-encoded)"] = "as stored (sRGB-encoded)"
    culling: Literal["none"] = "none"


class Manifest(Part):
    """manifest.json.

    Attributes:
        min_version: the oldest version whose readers show the asset right; they pass over keys that they do not know.
        extensions_used, extensions_required: names of extensions; who does not know a required one refuses the asset.
        bounds: of the meshes; absent where they are not known.
        levels: coarsest first; the last is the full one.
        stream: for players of DASH and HLS; absent where there are no segments.
        audio: of the sequence.
        photos: for comparison.
        track_file: the meshes' motion as a whole, one pose a frame (`track_file.py`); absent where they stand still.
        torso: what stays in the room while they move; absent where nothing does.
        view: the range that was filmed; absent where it is not known.
        manifest_sha256: of the manifest's own bytes with these 64 digits replaced by zeros.
    """

    format: Literal["facefolds"] = "facefolds"
    version: Literal[4] = 4
    min_version: Annotated[Literal[3], Field(alias="minVersion")] = 3
    extensions_used: Annotated[Maybe[tuple[ExtensionName, ...]], Field(alias="extensionsUsed")] = None
    extensions_required: Annotated[Maybe[tuple[ExtensionName, ...]], Field(alias="extensionsRequired")] = None
    generator: str
    subject: str
    coordinates: Coordinates
    compositing: Compositing = Compositing()
    bounds: Maybe[Bounds] = None
    levels: Annotated[tuple[Level, ...], Field(min_length=1)]
    stream: Maybe[Stream] = None
    audio: Audio | None = None
    poster: Poster | None = None
    photos: tuple[Photo, ...] = ()
    track_file: Maybe[StoredFile] = None
    torso: Maybe[StandingTorso] = None
    view: Maybe[FilmedView] = None
    manifest_sha256: Sha256 = UNSEALED

    @property
    def full(self) -> Level:
        return self.levels[-1]

    @property
    def pictures(self) -> list[Picture]:
        """Photos and poster."""
        return [*self.photos, *([] if self.poster is None else [self.poster])]

    def files(self) -> list[tuple[str, int, str]]:
        """(name, bytes, sha256) of every file but the manifest, each once."""
        others: list[StoredFile] = [*self.photos]
        others += [] if self.stream is None else [self.stream.dash, *self.stream.hls]
        others += [one for one in (self.audio, self.poster, self.track_file) if one is not None]
        found = list(dict.fromkeys(entry for level in self.levels for entry in level.files()))  # some are shared
        return found + [(other.file, other.bytes, other.sha256) for other in others]
