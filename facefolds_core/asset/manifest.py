"""manifest.json of an asset, format version 1 (docs/asset-format.md), as validated models.

The JSON schema beside this file, manifest.schema.json, says the same without our code; a test keeps the two in step.
"""

from __future__ import annotations

import hashlib
import json
import re
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from facefolds_core.errors import UserError
from facefolds_core.files import read_json, write_text
from facefolds_core.geometry.similarity import Similarity

FORMAT_VERSION = 1
MANIFEST_NAME = "manifest.json"
SCHEMA_PATH = Path(__file__).with_name("manifest.schema.json")
REMEDY = "make the asset again (`dvc repro`), or copy it again from where it is whole"

_SEAL = re.compile(rb'"manifest_sha256"\s*:\s*"([0-9a-f]{64})"')
_UNSEALED = "0" * 64

Count = Annotated[int, Field(ge=1)]
UV = Annotated[float, Field(ge=-1, le=1)]
FileName = Annotated[str, Field(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.-]*$")]
Sha256 = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
Offset = Annotated[int, Field(ge=0)]
Rect = tuple[Offset, Offset, Count, Count]
"""(x, y, width, height) in pixels from the top left corner of the video."""
Vector = tuple[float, float, float]


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


class Texture(Part):
    """The texture video.

    Attributes:
        level: of H.264 that a decoder must support.
        colour_rect, alpha_rect: in pixels of the decoded picture; of one size.
        layer_resolution: R^t, texels a side of each layer.
    """

    video: FileName
    bytes: Count
    sha256: Sha256
    codec: Literal["h264"] = "h264"
    level: Annotated[str, Field(pattern=r"^[1-6](\.[1-3])?$")]
    pixel_format: Literal["yuv420p"] = "yuv420p"
    width: Count
    height: Count
    colour_rect: Rect
    alpha_rect: Rect
    frames: Count
    fps: Annotated[float, Field(gt=0)]
    colour_space: Literal["bt709"] = "bt709"
    colour_range: Literal["tv"] = "tv"
    chroma_location: Literal["left"] = "left"
    layer_resolution: Count


class Compositing(Part):
    """How the layers are put together."""

    order: Literal["outermost first"] = "outermost first"
    alpha: Literal["straight"] = "straight"
    transfer: Literal["as stored (sRGB-encoded)"] = "as stored (sRGB-encoded)"
    culling: Literal["none"] = "none"


class Manifest(Part):
    """manifest.json.

    Attributes:
        layers: outermost first.
        manifest_sha256: of the manifest's own bytes with these 64 digits replaced by zeros.
    """

    format: Literal["facefolds"] = "facefolds"
    version: Literal[1] = 1
    generator: str
    subject: str
    coordinates: Coordinates
    layers: Annotated[tuple[Layer, ...], Field(min_length=1)]
    texture: Texture
    compositing: Compositing = Compositing()
    manifest_sha256: Sha256 = _UNSEALED


def manifest_schema() -> dict[str, Any]:
    """The JSON schema (draft 2020-12) of `Manifest`; keys with a default are required all the same in a file."""
    schema = Manifest.model_json_schema(mode="serialization")
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "facefolds asset, version 1"} | schema


def write_manifest(manifest: Manifest, path: Path) -> Manifest:
    """Write the manifest with its own checksum; returns it as written."""
    value = manifest.model_dump(mode="json") | {"manifest_sha256": _UNSEALED}
    text = json.dumps(value, indent=1, allow_nan=False) + "\n"
    digest = hashlib.sha256(text.encode()).hexdigest()
    write_text(path, text.replace(f'"manifest_sha256": "{_UNSEALED}"', f'"manifest_sha256": "{digest}"'))
    return manifest.model_copy(update={"manifest_sha256": digest})


def seal_is_whole(raw: bytes) -> bool:
    """Whether the bytes of a manifest agree with the checksum that stands in them."""
    found = _SEAL.findall(raw)
    if len(found) != 1:
        return False
    digest: bytes = found[0]
    return hashlib.sha256(raw.replace(digest, _UNSEALED.encode())).hexdigest() == digest.decode()


def parse_manifest(path: Path) -> Manifest:
    """Read and check a manifest by itself (not its checksum, and none of the files that it names).

    Raises:
        UserError: if it is missing, not JSON, not a facefolds asset, of another version, or a key is wrong.
    """
    value = read_json(path, remedy=REMEDY)
    if not isinstance(value, dict) or value.get("format") != "facefolds":
        found = value.get("format") if isinstance(value, dict) else type(value).__name__
        raise UserError(
            "not the manifest of a facefolds asset",
            file=path,
            place="format",
            expected="facefolds",
            found=found,
            remedy=REMEDY,
        )
    if value.get("version") != FORMAT_VERSION or isinstance(value.get("version"), bool):
        raise UserError(
            "an asset of another format version",
            file=path,
            place="version",
            expected=FORMAT_VERSION,
            found=value.get("version"),
            remedy="make the asset again with this version of facefolds, or read it with the one that made it",
        )
    try:
        manifest = Manifest.model_validate_json(path.read_bytes())
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        raise UserError(
            "the manifest is wrong",
            file=path,
            place=place,
            expected=first["msg"],
            found=repr(first["input"])[:200],
            remedy=REMEDY,
        ) from None
    missing = _missing_keys(manifest.model_dump(mode="json"), value)
    if missing:
        raise UserError("the manifest lacks keys", file=path, place=", ".join(missing), remedy=REMEDY)
    return manifest


def _missing_keys(whole: Any, given: Any, place: str = "") -> list[str]:
    """Dotted names of the keys of `whole` that `given` lacks (and whose defaults filled the gap)."""
    if isinstance(whole, dict):
        found = [f"{place}{key}" for key in whole if key not in given]
        pairs = [(key, whole[key], given[key]) for key in whole if key in given]
    elif isinstance(whole, list):
        found, pairs = [], [(str(i), a, b) for i, (a, b) in enumerate(zip(whole, given, strict=True))]
    else:
        return []
    return found + [name for key, a, b in pairs for name in _missing_keys(a, b, f"{place}{key}.")]


def write_schema() -> None:
    """Write manifest.schema.json again, after a change of the models."""
    write_text(SCHEMA_PATH, json.dumps(manifest_schema(), indent=1) + "\n")
