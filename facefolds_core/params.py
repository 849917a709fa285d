"""The sections of params.yaml and their keys: the only place that knows them.

`params_file.load_params` reads the file. Nothing below `stages/` reads a raw dictionary of parameters.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from facefolds_core.presets import PRESETS


class Section(BaseModel):
    """Base of all sections: frozen, unknown keys refused, no silent conversion of strings to numbers."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


Positive = Annotated[int, Field(ge=1)]
Unit = Annotated[float, Field(ge=0, le=1)]


class HoldoutEvery(Section):
    """Hold out every n-th camera of those that remain after culling, in the order of the capture."""

    every: Annotated[int, Field(ge=2)]


class FrameRange(Section):
    """Which frames of a segment to use: positions in its sorted list of frames, as in Python's range.

    Attributes:
        start: first position.
        stop: one past the last position; null means to the end.
        step: take every step-th frame.
    """

    start: Annotated[int, Field(ge=0)] = 0
    stop: Annotated[int, Field(ge=1)] | None = None
    step: Positive = 1


class CaptureParams(Section):
    """`capture`: the embedded actor (ignored for other sources).

    Attributes:
        cameras: number of cameras of the rig.
        frames: number of frames.
        height, width: of the images, pixels.
        fps: frames a second.
        seed: of the procedural skin, freckles and hair.
    """

    cameras: Annotated[int, Field(ge=3)] = 24
    frames: Positive = 12
    height: Annotated[int, Field(ge=16)] = 192
    width: Annotated[int, Field(ge=16)] = 128
    fps: Annotated[float, Field(gt=0)] = 30.0
    seed: int = 0


class NormalizeParams(Section):
    """`normalize`.

    Attributes:
        long_side, short_side: images are area-downsampled to fit into this box (aspect kept, never enlarged).
        max_elevation, max_azimuth: cameras beyond are culled; degrees, seen from the subject.
        display_colour: apply Multiface's display colour correction.
        stabilize: move each frame's cameras by the head pose so that the head stands still. Cameras then move from
            frame to frame, which the static background and held-out scoring do not expect: see docs/subjects.md.
    """

    long_side: Annotated[int, Field(ge=16)] = 768
    short_side: Annotated[int, Field(ge=16)] = 500
    max_elevation: Annotated[float, Field(gt=0, le=90)] = 45.0
    max_azimuth: Annotated[float, Field(gt=0, le=180)] = 90.0
    display_colour: bool = False
    stabilize: bool = False


class TrainParams(Section):
    """`train`: a preset, and any of its values overridden.

    Attributes:
        preset: a name from facefolds_core/presets.py; its values fill the keys that are not given.
        model: "mlp", the paper's, or "explicit": radius maps and texel grids; see docs/method.md.
        device: "auto" takes CUDA where there is one.
        seed: of initialisation and ray sampling.
        layers: N, number of manifolds.
        level_halfwidth: the N levels lie within this distance of the face surface, units.
        manifold_start: "sphere" (the paper's), or "surface": the tracked mesh, where there is one, by a short fit
            before training; without one it is the sphere.
        manifold_layers, manifold_width: hidden layers of the manifold predictor.
        output_scale: factor on its output: how far a step of Adam moves the surfaces.
        texture_layers, texture_width: hidden layers of the texture predictor.
        latent_dim: frame latents.
        uv_frequencies, level_frequencies, view_frequencies: octaves of the positional encodings.
        search_samples: M, samples a ray for the first crossings.
        rays: rays a batch.
        iterations: Adam steps; of the explicit model at least 183.
        lr_manifold, lr_texture: initial learning rates.
        decay_manifold, decay_texture: factors by which the rates fall each `decay_interval` iterations, exponentially.
        lambda_view, lambda_reg: weights of |view term|^2 and of |manifold weights|^2.
        lambda_veil: explicit model: weight of the opacity of a ray, so that what the background explains stays clear.
        lambda_solid: explicit model: weight of T (1 - T), T a ray's transmittance below 1/2: a face is solid.
        lr_volume: explicit model: learning rate of the density of the volume that its geometry starts from.
        checkpoint_seconds: a checkpoint is written this often.
    """

    preset: str = "fast"
    model: Literal["mlp", "explicit"] = "mlp"
    device: Literal["auto", "cpu", "cuda"] = "auto"
    seed: int = 0
    layers: Annotated[int, Field(ge=1, le=64)]
    level_halfwidth: Annotated[float, Field(gt=0, lt=0.2)]
    manifold_start: Literal["sphere", "surface"]
    manifold_layers: Positive
    manifold_width: Positive
    output_scale: Annotated[float, Field(gt=0)] = 1.0
    texture_layers: Positive
    texture_width: Positive
    latent_dim: Positive
    uv_frequencies: Annotated[int, Field(ge=0)]
    level_frequencies: Annotated[int, Field(ge=0)]
    view_frequencies: Annotated[int, Field(ge=0)]
    search_samples: Annotated[int, Field(ge=8)]
    rays: Positive
    iterations: Positive
    lr_manifold: Annotated[float, Field(ge=0)]
    lr_texture: Annotated[float, Field(gt=0)]
    decay_manifold: Annotated[float, Field(gt=0, le=1)]
    decay_texture: Annotated[float, Field(gt=0, le=1)]
    decay_interval: Positive
    lambda_view: Annotated[float, Field(ge=0)]
    lambda_reg: Annotated[float, Field(ge=0)]
    lambda_veil: Annotated[float, Field(ge=0)] = 0.003
    lambda_solid: Annotated[float, Field(ge=0)] = 0.003
    lr_volume: Annotated[float, Field(gt=0)] = 0.3
    checkpoint_seconds: Annotated[float, Field(gt=0)] = 60.0

    @model_validator(mode="before")
    @classmethod
    def _fill_from_preset(cls, value: Any) -> Any:
        if not isinstance(value, dict):
            return value
        name = value.get("preset", "fast")
        if not isinstance(name, str) or name not in PRESETS:
            raise ValueError(f"unknown preset {name!r}; there are {', '.join(sorted(PRESETS))}")
        return {**PRESETS[name], **value}


class SampleParams(Section):
    """`sample`.

    Attributes:
        resolution: R; each layer is sampled at R x R directions over the window.
        window: "full" is the whole hemisphere (the paper); "auto" is the part of it outside which no training ray that
            was looked at changes by more than 1/255 (export/window.py).
    """

    resolution: Annotated[int, Field(ge=8, le=4096)] = 512
    window: Literal["full", "auto"] = "auto"


class ReconstructParams(Section):
    """`reconstruct`.

    Attributes:
        method: "grid" takes the samples themselves as vertices; "poisson" is the paper's screened Poisson surface of
            each layer, trimmed to the sampled sheet.
        resolution: samples a side that are used (the R x R grid is thinned to it); null takes all.
        depth: poisson: of the octree, 2^depth cells along the longest side of the layer's bounding box and a tenth.
        point_weight: poisson: of the samples (screening).
        trim: poisson: vertices farther than this many local sample spacings from the samples are removed.
    """

    method: Literal["grid", "poisson"] = "grid"
    resolution: Annotated[int, Field(ge=8)] | None = None
    depth: Annotated[int, Field(ge=4, le=12)] = 7
    point_weight: Annotated[float, Field(ge=0)] = 4.0
    trim: Annotated[float, Field(gt=0)] = 2.0


class DecimateParams(Section):
    """`decimate`.

    Attributes:
        resolution: R^m; each layer keeps at most R^m x R^m vertices.
        uv: of Poisson surfaces: "nearest" gives a vertex the texture coordinates of the nearest sample (the paper),
            "exact" those of its own direction from the sphere centre. Vertices of `grid` are samples and keep theirs.
    """

    resolution: Annotated[int, Field(ge=8, le=2048)] = 64
    uv: Literal["nearest", "exact"] = "exact"


class TextureParams(Section):
    """`texture`.

    Attributes:
        resolution: R^t; texels a side of each layer's texture.
    """

    resolution: Annotated[int, Field(ge=8, le=4096)] = 512


class BakeParams(Section):
    """`bake`: textures are fitted to the meshes that ship.

    Attributes:
        iterations: passes over the training cameras' rays, in each frame; 0 leaves the textures as `texture` made them.
        hold: how dear a change of a texel from one frame to the next is, against the error that keeping still makes in
            training views (export/hold.py); larger values make smaller videos. 0 lets all texels tremble.
    """

    iterations: Annotated[int, Field(ge=0)] = 2
    hold: Annotated[float, Field(ge=0)] = 0.02


class MeshCodec(Section):
    """Draco.

    Attributes:
        quantization_bits: of positions; 0 stores all floats exactly (the paper's setting).
        texture_coordinate_bits: of texture coordinates, where positions are quantised.
        compression_level: 0 (fastest, the paper's, keeps the order of vertices) to 10.
        max_error_pixels: instead of numbers of bits: the fewest with which, in every training camera, no vertex moves
            by more than so many pixels, and no texture coordinate by more than so many texels.
    """

    max_error_pixels: Annotated[float, Field(gt=0)] | None = None

    quantization_bits: Annotated[int, Field(ge=0, le=24)] = 0
    texture_coordinate_bits: Annotated[int, Field(ge=1, le=24)] = 12
    compression_level: Annotated[int, Field(ge=0, le=10)] = 0


CodecName = Literal["h264", "vp9", "av1"]


class VideoCodec(Section):
    """Texture video.

    Attributes:
        codec: "h264", "vp9" or "av1", or a list of them: one file each with the same pictures, the first one first.
        crf: constant rate factor on x264's scale (smaller is better and larger); other codecs take the factor of about
            the same quality on theirs.
        target_psnr: instead of crf, the quality of rendered training views, dB against those of the textures before
            the codec; the coarsest factor that reaches it is searched.
        lossless: no loss beyond 8 bits and 4:2:0. In H.264 that is a profile which few hardware decoders know.
        preset: of libx264: slower ones make smaller files.
        keyframe_interval: frames between key frames: fewer make smaller files, more make scrubbing faster.
    """

    codec: tuple[CodecName, ...] = ("h264",)
    crf: Annotated[int, Field(ge=0, le=51)] = 18
    target_psnr: Annotated[float, Field(gt=10, lt=80)] | None = None
    lossless: bool = False
    preset: Literal["ultrafast", "superfast", "veryfast", "faster", "fast", "medium", "slow", "slower", "veryslow"] = (
        "slow"
    )
    keyframe_interval: Positive = 30

    @field_validator("codec", mode="before")
    @classmethod
    def _one_or_several(cls, value: Any) -> Any:
        return (value,) if isinstance(value, str) else value

    @field_validator("codec")
    @classmethod
    def _each_once(cls, value: tuple[CodecName, ...]) -> tuple[CodecName, ...]:
        if not value or len(set(value)) != len(value):
            raise ValueError("each codec once, at least one")
        return value


class GlbParams(Section):
    """The GLB beside the asset: one frame as binary glTF.

    Attributes:
        frame: index of the capture's frame whose textures it shows.
        draco: keep the meshes compressed (KHR_draco_mesh_compression, which not every program reads).
    """

    frame: Annotated[int, Field(ge=0)] = 0
    draco: bool = False


class LevelParams(Section):
    """A coarser level of detail, derived from the full one.

    Attributes:
        name: lower case letters, digits, - and _; not "full".
        mesh_resolution: at most so many vertices squared a layer, as R^m.
        texture_resolution: texels a side of a whole layer, as R^t.
        crf: of its videos, on x264's scale.
        max_error_pixels: as in `mesh`; null takes the full level's setting.
    """

    name: Annotated[str, Field(pattern=r"^[a-z0-9_-]+$")]
    mesh_resolution: Annotated[int, Field(ge=4, le=2048)]
    texture_resolution: Annotated[int, Field(ge=8, le=4096)]
    crf: Annotated[int, Field(ge=0, le=51)]
    max_error_pixels: Annotated[float, Field(gt=0)] | None = None


class CompressParams(Section):
    """`compress`.

    Attributes:
        levels: coarser levels of detail, the coarsest first; the full one is always there.
        view_effects: fit how the colours depend on the view, and ship it where it helps, for a tenth of the bytes of
            the full level at most. It needs an asset that stands before the room, not one that has it painted on.
        photos: photos of held-out cameras that ship with the asset, to compare with: at most so many.
        frame_rate_factor: the asset plays at 1, 2 or 3 times the capture's frames a second; what lies between the
            capture's frames follows the motion (export/between.py).
    """

    mesh: MeshCodec = MeshCodec()
    video: VideoCodec = VideoCodec()
    levels: tuple[LevelParams, ...] = ()
    photos: Annotated[int, Field(ge=0)] = 0
    frame_rate_factor: Literal[1, 2, 3] = 1
    glb: GlbParams = GlbParams()
    view_effects: bool = False

    @field_validator("levels")
    @classmethod
    def _names_differ(cls, value: tuple[LevelParams, ...]) -> tuple[LevelParams, ...]:
        if len({"full", *(level.name for level in value)}) != len(value) + 1:
            raise ValueError("two levels of one name (`full` is always there)")
        return value


class EvaluateParams(Section):
    """`evaluate` (it works on the device of `train`).

    Attributes:
        background: RGB in [0, 1] shown where the model or the asset is transparent.
        sheet_frames: frames shown for each held-out camera in the contact sheet, evenly spaced.
    """

    background: tuple[Unit, Unit, Unit] = (0.0, 0.0, 0.0)
    sheet_frames: Positive = 3


class Overrides(Section):
    """Stage sections that a subject may override, key by key."""

    capture: dict[str, Any] = {}
    normalize: dict[str, Any] = {}
    train: dict[str, Any] = {}
    sample: dict[str, Any] = {}
    reconstruct: dict[str, Any] = {}
    decimate: dict[str, Any] = {}
    texture: dict[str, Any] = {}
    bake: dict[str, Any] = {}
    compress: dict[str, Any] = {}
    evaluate: dict[str, Any] = {}


class Subject(Overrides):
    """One entry of `subjects`: where a capture is, what of it to use, and overrides of stage sections.

    Attributes:
        source: "actor" (generated), "multiface" or "transforms".
        path: folder of the capture; for "actor" the generator's package.
        segment: Multiface segment; null takes the only one.
        frames: a range of positions, or a list of frame names; null takes all.
        holdout: camera names, or {every: n}.
        front: for captures without a tracked mesh, the name of a camera that faces the subject upright.
        krt_size: [width, height] of the images that KRT refers to; null finds out.
        pixel_centres: where the capture's K puts the centre of the first pixel, 0 or 0.5; null takes the source's
            habit.
        fps: frames a second; null takes the source's (30 for Multiface).
    """

    source: Literal["actor", "multiface", "transforms"]
    path: str
    segment: str | None = None
    frames: FrameRange | tuple[str, ...] | None = None
    holdout: tuple[str, ...] | HoldoutEvery = HoldoutEvery(every=12)
    front: str | None = None
    krt_size: tuple[int, int] | None = None
    pixel_centres: Annotated[float, Field(ge=0, le=0.5, multiple_of=0.5)] | None = None
    fps: Annotated[float, Field(gt=0)] | None = None


STAGE_SECTIONS: dict[str, type[Section]] = {
    "capture": CaptureParams,
    "normalize": NormalizeParams,
    "train": TrainParams,
    "sample": SampleParams,
    "reconstruct": ReconstructParams,
    "decimate": DecimateParams,
    "texture": TextureParams,
    "bake": BakeParams,
    "compress": CompressParams,
    "evaluate": EvaluateParams,
}
