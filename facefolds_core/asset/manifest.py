"""What manifest.json of an asset says, format version 2 (docs/reference/asset-format.md), as validated models.

`manifest_file.py` reads and writes the file, and makes the JSON schema beside it.
"""

from __future__ import annotations

import json
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, field_validator

from facefolds_core.asset.codecs import CodecName
from facefolds_core.geometry.similarity import Similarity
from facefolds_core.geometry.track import Track

FORMAT_VERSION = 2
REMEDY = "make the asset again (`dvc repro`), or copy it again from where it is whole"

UNSEALED = "0" * 64
"""In the place of a manifest's own checksum, while that is taken."""

Count = Annotated[int, Field(ge=1)]
UV = Annotated[float, Field(ge=-1, le=1)]
FileName = Annotated[str, Field(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.-]*$", max_length=200)]
Sha256 = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
Offset = Annotated[int, Field(ge=0)]
Scale = Annotated[float, Field(gt=0, le=1000)]
Rect = tuple[Offset, Offset, Count, Count]
"""(x, y, width, height) in pixels from the top left corner of the video."""
Vector = tuple[float, float, float]
Row = tuple[float, float, float, float]


class Part(BaseModel):
    """Base: frozen, unknown keys refused, no conversion between kinds, no NaN."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        strict=True,
        allow_inf_nan=False,
        json_schema_serialization_defaults_required=True,
    )


class Transform(Part):
    """x -> scale * rotation @ x + translation; rotation by rows."""

    scale: Annotated[float, Field(gt=0)]
    rotation: tuple[Vector, Vector, Vector]
    translation: Vector

    @classmethod
    def of(cls, similarity: Similarity) -> Transform:
        return cls.model_validate_json(json.dumps(similarity.to_json()))

    def similarity(self) -> Similarity:
        return Similarity.from_json(self.model_dump(mode="json"))


class Coordinates(Part):
    """Axes and units of the meshes, and the way back to the capture."""

    handedness: Literal["right"] = "right"
    forward: Literal["+x"] = "+x"
    up: Literal["+z"] = "+z"
    units: Literal["normalised"] = "normalised"
    to_capture: Transform
    sphere_centre: Vector


class StoredFile(Part):
    """A file of the asset's folder, with what it must hold."""

    file: FileName
    bytes: Count
    sha256: Sha256


class Layer(Part):
    """One mesh and its place in the video.

    Attributes:
        texture_rect: of its colour, within the colour image; its alpha has the same place within the alpha image.
        uv_window: (u0, u1, v0, v1), what its texture covers of the hemisphere's (u, v).
    """

    mesh: FileName
    vertices: Count
    triangles: Count
    bytes: Count
    sha256: Sha256
    texture_rect: Rect
    uv_window: tuple[UV, UV, UV, UV]


class Video(StoredFile):
    """One encoding of the textures' pictures.

    Attributes:
        mime: MIME type with codec string, as browsers take it.
        level: of the codec, that a decoder must support.
    """

    container: Literal["mp4", "webm"]
    codec: CodecName
    mime: str
    level: Annotated[str, Field(pattern=r"^[1-7](\.[0-3])?$")]
    pixel_format: Literal["yuv420p"] = "yuv420p"


class Texture(Part):
    """The textures of a level: pictures, encoded once or in several ways.

    Attributes:
        width, height: of the decoded picture.
        colour_rect, alpha_rect: in pixels of the decoded picture; of one size.
        videos: the same pictures; a player takes the first that it can decode.
    """

    width: Count
    height: Count
    colour_rect: Rect
    alpha_rect: Rect
    frames: Count
    fps: Annotated[float, Field(gt=0)]
    colour_space: Literal["bt709"] = "bt709"
    colour_range: Literal["tv"] = "tv"
    chroma_location: Literal["left"] = "left"
    videos: Annotated[tuple[Video, ...], Field(min_length=1)]


class Reflection(StoredFile):
    """What gloss adds to the colours by the direction; players may ignore it.

    Attributes:
        width, height: of the PNG.
        uv_window: (u0, u1, v0, v1), what gloss, offset and normals cover of the hemisphere's (u, v).
        environment_rect, gloss_rect, offset_rect, normals_rect: in pixels of the PNG.
        environment_scale, gloss_scale, offset_scale: what code 255 means; code 0 is 0, of the offset its negative.
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
    """

    psnr_to_model: float


class Level(Part):
    """One level of detail, complete in itself.

    Attributes:
        layers: outermost first; their number may differ between levels.
        reflection: what gloss adds; absent where there is none.
        bytes: of all its files.
    """

    name: Annotated[str, Field(pattern=r"^[a-z0-9_-]+$")]
    layers: Annotated[tuple[Layer, ...], Field(min_length=1)]
    texture: Texture
    reflection: Annotated[Reflection | None, Field(exclude_if=lambda one: one is None)] = None
    bytes: Count
    quality: Quality | None = None

    @field_validator("reflection")
    @classmethod
    def _absent_or_whole(cls, value: Reflection | None) -> Reflection:
        if value is None:
            raise ValueError("a reflection, or no such key")
        return value

    def files(self) -> list[tuple[str, int, str]]:
        """(name, bytes, sha256) of each of its files, the meshes first."""
        found = [(layer.mesh, layer.bytes, layer.sha256) for layer in self.layers]
        others: list[StoredFile] = [*self.texture.videos, *([self.reflection] if self.reflection else [])]
        return found + [(other.file, other.bytes, other.sha256) for other in others]


class Poster(StoredFile):
    """A still picture of the asset, shown while it loads."""

    width: Count
    height: Count


class Photo(Poster):
    """A photo of the capture and the camera that took it, to compare with.

    Attributes:
        camera, frame: the capture's name of the camera, the index of the frame.
        K: intrinsics, rows; continuous pixel coordinates.
        w2c: (R | t), rows: normalised coordinates to OpenCV's camera axes.
    """

    camera: str
    frame: Offset
    K: tuple[Vector, Vector, Vector]
    w2c: tuple[Row, Row, Row]


class Pose(Part):
    """Where the head stands in one frame: X_world = R X_mesh + t, normalised coordinates.

    Attributes:
        quaternion: w, x, y, z of R, of unit length.
        translation: t.
    """

    quaternion: Row
    translation: Vector


class FilmedView(Part):
    """Directions that the subject was filmed from, seen from the origin: a player need not go beyond them.

    Attributes:
        azimuth: the smallest arc with all training cameras, degrees from +x towards +y; its middle is in [-180, 180].
        elevation: the range of the training cameras, degrees.
    """

    azimuth: tuple[Annotated[float, Field(ge=-360, le=360)], Annotated[float, Field(ge=-360, le=360)]]
    elevation: tuple[Annotated[float, Field(ge=-90, le=90)], Annotated[float, Field(ge=-90, le=90)]]

    @field_validator("azimuth", "elevation")
    @classmethod
    def _in_order(cls, value: tuple[float, float]) -> tuple[float, float]:
        if not value[0] <= value[1] <= value[0] + 360:
            raise ValueError("from the lower to the higher angle, at most a full turn")
        return value


class Compositing(Part):
    """How the layers are put together."""

    order: Literal["outermost first"] = "outermost first"
    alpha: Literal["straight"] = "straight"
    transfer: Literal["as stored (sRGB-encoded)"] = "as stored (sRGB-encoded)"
    culling: Literal["none"] = "none"


class Manifest(Part):
    """manifest.json.

    Attributes:
        levels: coarsest first; the last is the full one.
        audio: of the sequence; it is in the MP4 files too.
        photos: for comparison.
        track: the meshes' motion as a whole, one pose a frame; absent where they stand still.
        view: the range that was filmed; absent where it is not known.
        manifest_sha256: of the manifest's own bytes with these 64 digits replaced by zeros.
    """

    format: Literal["facefolds"] = "facefolds"
    version: Literal[2] = 2
    generator: str
    subject: str
    coordinates: Coordinates
    compositing: Compositing = Compositing()
    levels: Annotated[tuple[Level, ...], Field(min_length=1)]
    audio: StoredFile | None = None
    poster: Poster | None = None
    photos: tuple[Photo, ...] = ()
    track: Annotated[tuple[Pose, ...] | None, Field(exclude_if=lambda track: track is None)] = None
    view: Annotated[FilmedView | None, Field(exclude_if=lambda view: view is None)] = None
    manifest_sha256: Sha256 = UNSEALED

    @field_validator("track")
    @classmethod
    def _absent_or_poses(cls, value: tuple[Pose, ...] | None) -> tuple[Pose, ...] | None:
        if value is None:
            raise ValueError("poses, or no such key")
        return value

    @field_validator("view")
    @classmethod
    def _absent_or_whole(cls, value: FilmedView | None) -> FilmedView:
        if value is None:
            raise ValueError("the filmed range, or no such key")
        return value

    @property
    def full(self) -> Level:
        return self.levels[-1]

    def head_track(self) -> Track | None:
        """`track` as it is computed with."""
        if self.track is None:
            return None
        quaternions, translations = ([list(getattr(pose, name)) for pose in self.track] for name in Pose.model_fields)
        return Track(np.array(quaternions, float), np.array(translations, float))

    def files(self) -> list[tuple[str, int, str]]:
        """(name, bytes, sha256) of every file but the manifest."""
        others: list[StoredFile] = [*self.photos]
        others += [one for one in (self.audio, self.poster) if one is not None]
        found = [entry for level in self.levels for entry in level.files()]
        return found + [(other.file, other.bytes, other.sha256) for other in others]
