"""`compress`: the asset that ships."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, field_validator

from facefolds_core.params.base import Count, Many, Natural, Pixels, Section, TextureSide

CodecName = Literal["h264", "vp9", "av1"]
ConstantRateFactor = Annotated[int, Field(ge=0, le=51)]


def _one_or_several(value: Any) -> Any:
    return (value,) if isinstance(value, str) else value


class MeshCodec(Section):
    """Draco."""

    max_error_pixels: Pixels | None = None
    """Instead of numbers of bits: the fewest with which, in every training camera, no vertex moves by more than so many
    pixels, and no texture coordinate by more than so many texels."""

    quantization_bits: Annotated[int, Field(ge=0, le=24)] = 0
    """Of positions; 0 stores all floats exactly (the paper's setting)."""

    texture_coordinate_bits: Annotated[int, Field(ge=1, le=24)] = 12
    """Of texture coordinates, where positions are quantised."""

    compression_level: Annotated[int, Field(ge=0, le=10)] = 0
    """0 (fastest, the paper's, keeps the order of vertices) to 10."""


class VideoCodec(Section):
    """Texture video."""

    codec: Annotated[Many[CodecName], BeforeValidator(_one_or_several)] = ("h264",)
    """"h264", "vp9" or "av1", or a list of them: one file each with the same pictures, the first one first."""

    crf: ConstantRateFactor = 18
    """Constant rate factor on x264's scale (smaller is better and larger); other codecs take the factor of about the
    same quality on theirs."""

    target_psnr: Annotated[float, Field(gt=10, lt=80)] | None = None
    """Instead of crf, the quality of rendered training views, dB against those of the textures before the codec; the
    coarsest factor that reaches it is searched."""

    lossless: bool = False
    """No loss beyond 8 bits and 4:2:0. In H.264 that is a profile which few hardware decoders know."""

    preset: Literal["ultrafast", "superfast", "veryfast", "faster", "fast", "medium", "slow", "slower", "veryslow"] = (
        "slow"
    )
    """Of libx264: slower ones make smaller files."""

    keyframe_interval: Count = 30
    """Frames between key frames: fewer make smaller files, more make scrubbing faster."""

    @field_validator("codec")
    @classmethod
    def _each_once(cls, value: tuple[CodecName, ...]) -> tuple[CodecName, ...]:
        if not value or len(set(value)) != len(value):
            raise ValueError("each codec once, at least one")
        return value


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
    """At most so many vertices squared a layer, as R^m."""

    texture_resolution: TextureSide
    """Texels a side of a whole layer, as R^t."""

    crf: ConstantRateFactor
    """Of its videos, on x264's scale."""

    max_error_pixels: Pixels | None = None
    """As in `mesh`; null takes the full level's setting."""


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

    frame_rate_factor: Literal[1, 2, 3] = 1
    """The asset plays at 1, 2 or 3 times the capture's frames a second; what lies between the capture's frames follows
    the motion (export/between.py)."""

    glb: GlbParams = GlbParams()
    """One frame for programs that read glTF."""

    view_effects: bool = False
    """Fit how the colours depend on the view, and ship it where it helps, for a tenth of the bytes of the full level at
    most. It needs an asset that stands before the room, not one that has it painted on."""

    @field_validator("levels")
    @classmethod
    def _names_differ(cls, value: tuple[LevelParams, ...]) -> tuple[LevelParams, ...]:
        if len({"full", *(level.name for level in value)}) != len(value) + 1:
            raise ValueError("two levels of one name (`full` is always there)")
        return value
