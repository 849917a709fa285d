"""`compress`: the asset that ships."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BeforeValidator, Field, field_validator

from facefolds_core.params.base import Count, Many, Natural, Pixels, Section, TextureSide
from facefolds_core.registry import CODECS

if TYPE_CHECKING:
    CodecName = str
else:
    CodecName = Literal[CODECS.names]
ConstantRateFactor = Annotated[int, Field(ge=0, le=51)]


def _one_or_several(value: Any) -> Any:
    return (value,) if isinstance(value, str) else value


class MeshCodec(Section):
    """Draco."""

    max_error_pixels: Pixels | None = 0.1
    """Takes the fewest bits with which no vertex moves by more pixels than this in any training camera, and no texture
    coordinate by more texels; at most 20. null takes the numbers of bits."""

    quantization_bits: Annotated[int, Field(ge=0, le=24)] = 0
    """Bits of positions; 0 stores all floats exactly (the paper's setting)."""

    texture_coordinate_bits: Annotated[int, Field(ge=1, le=24)] = 12
    """Bits of texture coordinates, where positions are quantised."""

    compression_level: Annotated[int, Field(ge=0, le=10)] = 10
    """Draco's level, from 0 (fastest; keeps the order of vertices; the paper's) to 10 (smallest)."""


class VideoCodec(Section):
    """Texture video."""

    codec: Annotated[Many[CodecName], BeforeValidator(_one_or_several)] = ("h264",)
    """One codec, or a list: one file each with the same pictures."""

    crf: ConstantRateFactor = 18
    """Constant rate factor on x264's scale; smaller is better and larger. Other codecs take theirs of about the same
    quality."""

    target_psnr: Annotated[float, Field(gt=10, lt=80)] | None = 43.0
    """Quality of rendered training views against those of the uncoded textures, dB; takes the place of the full
    level's `crf`, which is searched for."""

    preset: Literal["ultrafast", "superfast", "veryfast", "faster", "fast", "medium", "slow", "slower", "veryslow"] = (
        "veryslow"
    )
    """Preset of libx264: slower ones make smaller files."""

    keyframe_interval: Count = 30
    """Frames between key frames: more make smaller files, fewer make scrubbing faster. A stream has one a segment
    (`stream.segment_seconds`)."""

    @field_validator("codec")
    @classmethod
    def _each_once(cls, value: tuple[CodecName, ...]) -> tuple[CodecName, ...]:
        if not value or len(set(value)) != len(value):
            raise ValueError("each codec once, at least one")
        return value


class AttentionParams(Section):
    """Bits where they show: what hardly shows in training views is coded coarsely. H.264 only."""

    strength: Annotated[float, Field(ge=0, le=6)] = 2.0
    """Steps of the quantiser for each halving of what an error does to the pictures; 0 codes all alike (the paper's
    setting)."""


class StreamParams(Section):
    """Long takes as streams of segments, at the quality that the connection allows."""

    beyond: Annotated[float, Field(ge=0, le=1e9)] = 20.0
    """An asset that is longer, seconds, is written as a stream. 1e9: none is."""

    segment_seconds: Annotated[float, Field(ge=0.1, le=60)] = 2.0
    """Length of a segment, seconds: short ones seek faster, long ones are smaller."""


class LevelParams(Section):
    """A coarser level of detail, derived from the full one."""

    name: Annotated[str, Field(pattern=r"^[a-z0-9_-]+$", max_length=64)]
    """Lower case letters, digits, - and _; not "full"."""

    mesh_resolution: Annotated[int, Field(ge=4, le=2048)]
    """R^m: at most so many vertices squared a layer."""

    texture_resolution: TextureSide
    """R^t: texels a side of a whole layer."""

    crf: ConstantRateFactor
    """Constant rate factor of its videos, on x264's scale."""

    max_error_pixels: Pixels | None = None
    """As in `compress.mesh`; null takes the full level's setting."""


class CompressParams(Section):
    """Meshes, videos, levels of detail and what else ships with them."""

    mesh: MeshCodec = MeshCodec()
    """How meshes are compressed."""

    video: VideoCodec = VideoCodec()
    """How textures are compressed."""

    levels: Many[LevelParams] = (
        LevelParams(name="small", mesh_resolution=16, texture_resolution=128, crf=35, max_error_pixels=0.5),
        LevelParams(name="medium", mesh_resolution=32, texture_resolution=256, crf=34, max_error_pixels=0.2),
    )
    """Coarser levels of detail, the coarsest first; the full one is always there."""

    photos: Natural = 0
    """Photos of held-out cameras that ship with the asset, to compare with: at most so many."""

    stream: StreamParams = StreamParams()
    """Segments, DASH and HLS for long takes."""

    attention: AttentionParams = AttentionParams()
    """Where the videos' bits go."""

    @field_validator("levels")
    @classmethod
    def _names_differ(cls, value: tuple[LevelParams, ...]) -> tuple[LevelParams, ...]:
        if len({"full", *(level.name for level in value)}) != len(value) + 1:
            raise ValueError("two levels of one name (`full` is always there)")
        return value
