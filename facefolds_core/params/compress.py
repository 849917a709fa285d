"""`compress`: the asset that ships."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BeforeValidator, Field, field_validator

from facefolds_core.params.base import Count, Many, Natural, Pixels, Section, Share, TextureSide
from facefolds_core.registry import CODECS

if TYPE_CHECKING:
    CodecName = str
else:
    CodecName = Literal[CODECS.names]
ConstantRateFactor = Annotated[int, Field(ge=0, le=51)]
Decibels = Annotated[float, Field(ge=0, le=100)]


def _one_or_several(value: Any) -> Any:
    return (value,) if isinstance(value, str) else value


class MeshCodec(Section):
    """Draco."""

    max_error_pixels: Pixels | None = None
    """Takes the fewest bits with which no vertex moves by more pixels than this in any training camera, and no texture
    coordinate by more texels. null takes the numbers of bits."""

    quantization_bits: Annotated[int, Field(ge=0, le=24)] = 0
    """Bits of positions; 0 stores all floats exactly (the paper's setting)."""

    texture_coordinate_bits: Annotated[int, Field(ge=1, le=24)] = 12
    """Bits of texture coordinates, where positions are quantised."""

    compression_level: Annotated[int, Field(ge=0, le=10)] = 0
    """Draco's level, from 0 (fastest; keeps the order of vertices; the paper's) to 10."""

    max_bits: Annotated[int, Field(ge=1, le=24)] = 20
    """Bits that `max_error_pixels` may take, at most."""


class VideoCodec(Section):
    """Texture video."""

    codec: Annotated[Many[CodecName], BeforeValidator(_one_or_several)] = ("h264",)
    """One codec, or a list: one file each with the same pictures."""

    crf: ConstantRateFactor = 18
    """Constant rate factor on x264's scale; smaller is better and larger. Other codecs take theirs of about the same
    quality."""

    target_psnr: Annotated[float, Field(gt=10, lt=80)] | None = None
    """Quality of rendered training views against those of the uncoded textures, dB; takes the place of `crf`, which is
    searched for."""

    lossless: bool = False
    """No loss beyond 8 bits and 4:2:0. Few hardware decoders know H.264's profile for it."""

    preset: Literal["ultrafast", "superfast", "veryfast", "faster", "fast", "medium", "slow", "slower", "veryslow"] = (
        "slow"
    )
    """Preset of libx264: slower ones make smaller files."""

    keyframe_interval: Count = 30
    """Frames between key frames: more make smaller files, fewer make scrubbing faster."""

    @field_validator("codec")
    @classmethod
    def _each_once(cls, value: tuple[CodecName, ...]) -> tuple[CodecName, ...]:
        if not value or len(set(value)) != len(value):
            raise ValueError("each codec once, at least one")
        return value


class CrfSearchParams(Section):
    """The search for `video.target_psnr`: few encodings (packaging/rate.py)."""

    frames: Count = 30
    """Frames that an attempt encodes, at most, from the first on."""

    max_encodes: Count = 6
    """Attempts; as many again where the target is out of reach."""

    tolerance: Decibels = 0.15
    """The search ends early within this of the target, dB above it."""

    spared: Decibels = 0.2
    """Where the target is out of reach, so many dB are given up for fewer bits."""

    slope: Annotated[float, Field(gt=0, le=100)] = 0.4
    """Rough cost of one step of the factor, dB: for the second attempt."""

    noticed: Annotated[float, Field(ge=0, le=80)] = 0.5
    """A target missed by more than this, dB, is said."""


class MeterParams(Section):
    """The yardstick of packaging: rendered training views (packaging/views.py)."""

    cameras: Count = 6
    """Training cameras, evenly spread."""

    frames: Count = 3
    """Frames, evenly spread."""

    rays_per_camera: Count = 16_000
    """Rays of each camera that hit anything, drawn once."""


class AttentionParams(Section):
    """Bits where they show: what hardly shows in training views is coded coarsely. H.264 only."""

    strength: Annotated[float, Field(ge=0, le=6)] = 2.0
    """Steps of the quantiser for each halving of what an error does to the pictures; 0 codes all alike (the paper's
    setting)."""

    least: Annotated[float, Field(gt=0, le=1)] = 0.01
    """What shows less than this share of what shows most counts as that much: someone may look from elsewhere."""

    cameras: Count = 24
    """Training cameras that are looked through, evenly spread."""

    frames: Count = 3
    """Frames, evenly spread; the one counts in which a place shows most."""

    of: Literal["take", "segment"] = "take"
    """For segments of a stream: look at frames of the whole take, or at the segment's middle frame. With "segment" a
    changed frame costs its own segments only."""

    rays_per_camera: Count = 16_000
    """Rays of each camera that hit anything, drawn once."""


class StreamParams(Section):
    """Long takes as streams of segments, at the quality that the connection allows."""

    beyond: Annotated[float, Field(ge=0, le=1e9)] = 20.0
    """An asset that is longer, seconds, is written as a stream. 1e9: none is."""

    segment_seconds: Annotated[float, Field(ge=0.1, le=60)] = 2.0
    """Length of a segment, seconds: short ones seek faster, long ones are smaller."""

    encoders: Natural = 1
    """Segments encoded at once, each with 200 bytes of memory a pixel. 0: as many as there are cores and `megabytes`
    for."""

    megabytes: Annotated[int, Field(ge=1, le=1_000_000)] = 2048
    """Memory for encoders, if there are several, MB."""


class BetweenParams(Section):
    """What lies between the capture's frames, for `frame_rate_factor` above 1 (export/between.py)."""

    min_side: Annotated[int, Field(ge=16, le=4096)] = 16
    """Below so many texels a side no motion is looked for, and frames are mixed."""

    fixed_point_steps: Count = 6
    """Steps to find which texel is at a place at a time."""

    min_crowd: Annotated[float, Field(gt=0, le=1)] = 0.001
    """Least weight of a frame whose texels are stretched over a gap."""

    behind: Share = 0.5
    """Grey behind the composite whose motion is measured."""


class GlbParams(Section):
    """The GLB beside the asset: one frame as binary glTF."""

    frame: Natural = 0
    """Index of the capture's frame whose textures it shows."""

    draco: bool = False
    """Keep the meshes compressed (KHR_draco_mesh_compression, which not every program reads)."""


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

    levels: Many[LevelParams] = ()
    """Coarser levels of detail, the coarsest first; the full one is always there."""

    photos: Natural = 0
    """Photos of held-out cameras that ship with the asset, to compare with: at most so many."""

    frame_rate_factor: Annotated[int, Field(ge=1, le=3)] = 1
    """The asset plays at 1, 2 or 3 times the capture's frames a second; frames between follow the motion."""

    stream: StreamParams = StreamParams()
    """Segments, DASH and HLS for long takes."""

    glb: GlbParams = GlbParams()
    """One frame for programs that read glTF."""

    poster_side: Annotated[int, Field(ge=16, le=4096)] = 720
    """Longer side of the poster, pixels; no more than the capture's pictures have."""

    jpeg_quality: Annotated[int, Field(ge=1, le=100)] = 92
    """Quality of poster and photos, on JPEG's scale."""

    search: CrfSearchParams = CrfSearchParams()
    """For `video.target_psnr`."""

    meter: MeterParams = MeterParams()
    """What quality is measured on."""

    attention: AttentionParams = AttentionParams()
    """Where the videos' bits go."""

    between: BetweenParams = BetweenParams()
    """For `frame_rate_factor`."""

    @field_validator("levels")
    @classmethod
    def _names_differ(cls, value: tuple[LevelParams, ...]) -> tuple[LevelParams, ...]:
        if len({"full", *(level.name for level in value)}) != len(value) + 1:
            raise ValueError("two levels of one name (`full` is always there)")
        return value
