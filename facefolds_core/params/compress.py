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
    """Instead of numbers of bits: the fewest with which, in every training camera, no vertex moves by more than so many
    pixels, and no texture coordinate by more than so many texels."""

    quantization_bits: Annotated[int, Field(ge=0, le=24)] = 0
    """Of positions; 0 stores all floats exactly (the paper's setting)."""

    texture_coordinate_bits: Annotated[int, Field(ge=1, le=24)] = 12
    """Of texture coordinates, where positions are quantised."""

    compression_level: Annotated[int, Field(ge=0, le=10)] = 0
    """0 (fastest, the paper's, keeps the order of vertices) to 10."""

    max_bits: Annotated[int, Field(ge=1, le=24)] = 20
    """Of positions and texture coordinates that `max_error_pixels` may take: beyond, floats are no finer."""


class VideoCodec(Section):
    """Texture video."""

    codec: Annotated[Many[CodecName], BeforeValidator(_one_or_several)] = ("h264",)
    """One, or a list of them: one file each with the same pictures, the first one first."""

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


class CrfSearchParams(Section):
    """The search for `video.target_psnr`: few encodings (packaging/rate.py)."""

    frames: Count = 30
    """An attempt encodes at most so many frames, from the first on."""

    max_encodes: Count = 6
    """Attempts; as many again where the target is out of reach."""

    tolerance: Decibels = 0.15
    """dB above the target at which the search ends early."""

    spared: Decibels = 0.2
    """dB given up where the target is out of reach: bits without end would buy nothing."""

    slope: Annotated[float, Field(gt=0, le=100)] = 0.4
    """dB that one step of the factor costs, roughly, of any encoder: for the second attempt."""

    noticed: Annotated[float, Field(ge=0, le=80)] = 0.5
    """dB below the target from which on it is said that it was missed: more than the search's own tolerance."""


class MeterParams(Section):
    """The yardstick of packaging: rendered training views (packaging/views.py)."""

    cameras: Count = 6
    """Training cameras, evenly spread."""

    frames: Count = 3
    """Evenly spread."""

    rays_per_camera: Count = 16_000
    """Of those that hit anything, drawn once."""


class AttentionParams(Section):
    """Bits where they show: what hardly shows in training views is coded coarsely (packaging/attention.py). H.264 only:
    the other encoders know no regions."""

    strength: Annotated[float, Field(ge=0, le=6)] = 2.0
    """Steps of the quantiser (six double it) for each halving of what an error does to the pictures; 0 codes all of the
    atlas alike (the paper's setting), 3 is where errors would cost the same everywhere."""

    least: Annotated[float, Field(gt=0, le=1)] = 0.01
    """What shows less than this share of what shows most is treated as if it showed as much: someone may look from
    where no camera stood."""

    cameras: Count = 24
    """Training cameras that are looked through, evenly spread."""

    frames: Count = 3
    """Evenly spread; the one counts in which a place shows most."""

    of: Literal["take", "segment"] = "take"
    """What is looked at for a segment of a stream: those frames of the take, or the one in the segment's middle. With
    "segment" a frame that changes has only the segments encoded again that changed; with "take" all, if one of those
    frames is near."""

    rays_per_camera: Count = 16_000
    """Of those that hit anything, drawn once."""


class StreamParams(Section):
    """Long takes as streams: videos that players fetch in segments, at the quality that the connection allows."""

    beyond: Annotated[float, Field(ge=0, le=1e9)] = 20.0
    """Seconds; an asset that is longer is written as a stream. 1e9: none is."""

    segment_seconds: Annotated[float, Field(ge=0.1, le=60)] = 2.0
    """Of a segment, rounded to whole frames: short ones switch and seek faster, long ones are smaller."""

    encoders: Natural = 1
    """Segments that are encoded at once, each with the memory of an encoder, 200 bytes a pixel of the picture (0.8 GB
    of 4 megapixels). 1: a long take needs no more than a short one. 0: as many as there are cores and `megabytes` for.
    The result does not depend on it."""

    megabytes: Annotated[int, Field(ge=1, le=1_000_000)] = 2048
    """Memory for encoders, if there are several."""


class BetweenParams(Section):
    """What lies between the capture's frames, for `frame_rate_factor` above 1 (export/between.py)."""

    min_side: Annotated[int, Field(ge=16, le=4096)] = 16
    """Texels a side below which no motion is looked for: frames are mixed."""

    fixed_point_steps: Count = 6
    """To find which texel is at a place at a time."""

    min_crowd: Annotated[float, Field(gt=0, le=1)] = 0.001
    """Weight of a frame whose texels are stretched over a gap, at least."""

    behind: Share = 0.5
    """Grey behind the composite whose motion is measured: an outline must not look like the edge of something black."""


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

    frame_rate_factor: Annotated[int, Field(ge=1, le=3)] = 1
    """The asset plays at 1, 2 or 3 times the capture's frames a second; what lies between the capture's frames follows
    the motion (export/between.py)."""

    stream: StreamParams = StreamParams()
    """Segments, DASH and HLS for long takes."""

    glb: GlbParams = GlbParams()
    """One frame for programs that read glTF."""

    poster_side: Annotated[int, Field(ge=16, le=4096)] = 720
    """Pixels of the poster's longer side; no more than that of the capture's pictures."""

    jpeg_quality: Annotated[int, Field(ge=1, le=100)] = 92
    """Of poster and photos, on JPEG's scale."""

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
