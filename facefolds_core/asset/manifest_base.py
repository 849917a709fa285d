"""What all parts of a manifest share: kinds of numbers, names and ranges, and the keys that any part may have."""

from __future__ import annotations

from typing import Annotated, Any, TypeVar

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationInfo

Count = Annotated[int, Field(ge=1)]
RateTerm = Annotated[int, Field(ge=1, le=1_000_000_000)]
Offset = Annotated[int, Field(ge=0)]
UV = Annotated[float, Field(ge=-2, le=2)]
Scale = Annotated[float, Field(gt=0, le=1000)]
FileName = Annotated[str, Field(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.-]*$", max_length=200)]
Name = Annotated[str, Field(pattern=r"^[a-z0-9_-]+$")]
ExtensionName = Annotated[str, Field(min_length=1, max_length=100)]
Sha256 = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
Rect = tuple[Offset, Offset, Count, Count]
"""(x, y, width, height) in pixels from the top left corner of the video."""
Vector = tuple[float, float, float]
Row = tuple[float, float, float, float]

FARTHEST = 1e3
"""Units that anything of an asset may lie from the origin."""

ABSENT = "x-absent"
"""Marks keys of the schema that are there with a value or not at all."""

T = TypeVar("T")


def _given(value: T, info: ValidationInfo) -> T:
    if value is None and info.mode == "json":
        raise ValueError("a value, or no such key")
    return value


Maybe = Annotated[
    T | None,
    AfterValidator(_given),
    Field(exclude_if=lambda value: value is None, json_schema_extra={ABSENT: True}),
]
"""Of a key that is absent where there is nothing to say; null is refused in a file."""


class Part(BaseModel):
    """Base: frozen, unknown keys refused, no conversion between kinds, no NaN.

    Attributes:
        extensions: name -> what an extension adds; the names are in the manifest's `extensionsUsed`. As in glTF.
        extras: anything, of the application's own.
    """

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        strict=True,
        allow_inf_nan=False,
        json_schema_serialization_defaults_required=True,
        serialize_by_alias=True,
    )

    extensions: Maybe[dict[ExtensionName, dict[str, Any]]] = None
    extras: Maybe[Any] = None


class StoredFile(Part):
    """A file of the asset's folder, with what it must hold."""

    file: FileName
    bytes: Count
    sha256: Sha256


class ByteRange(Part):
    """Some bytes of a file."""

    offset: Offset
    bytes: Count
    sha256: Sha256


def without_absent(schema: dict[str, Any]) -> None:
    """Of a JSON schema, in place: keys marked `ABSENT` are not required, and null is none of their values."""
    for part in [schema, *schema.get("$defs", {}).values()]:
        for key, said in part.get("properties", {}).items():
            if not said.pop(ABSENT, False):
                continue
            said.pop("default", None)
            part["required"] = [name for name in part.get("required", []) if name != key]
            choices = [choice for choice in said.pop("anyOf", []) if choice != {"type": "null"}]
            said.update(choices[0] or {"not": {"type": "null"}})
