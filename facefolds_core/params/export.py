"""`sample`, `reconstruct`, `decimate`, `texture` and `bake`: from the model to meshes and textures."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from facefolds_core.params.base import Count, Factor, Many, Natural, Section, Share, TextureSide, Weight
from facefolds_core.params.choice import MeshChoiceParams, TextureChoiceParams

Aggressiveness = Annotated[int, Field(ge=1, le=10)]


class AutoWindowParams(Section):
    """How `window: auto` is found: where the training cameras see something (export/window.py)."""

    max_change: Share = 1 / 255
    """Largest change of a ray's colour by what the window leaves out: one step of an 8-bit image."""

    rays_per_camera: Count = 2500
    """Rays of the lattice laid over each image, at most."""

    frames: Count = 3
    """Frames that are looked at, evenly spread."""

    moving_views: Count = 3
    """Frames of each training camera that are looked at where the head turns."""

    margin: Factor = 2.0
    """Margin on each side, in steps of the lattice of rays on the surface."""


class SampleParams(Section):
    """Each layer's surface at the nodes of a grid of directions."""

    resolution: Literal["auto"] | TextureSide = "auto"
    """R: each layer is sampled at R x R directions over the window. "auto" is the least multiple of 64 that loses no
    texel of the model, and `sample.least`."""

    least: TextureSide = 512
    """Least R that `auto` takes."""

    window: Literal["full", "auto"] = "auto"
    """ "full" is all that the model has (the paper's hemisphere); "auto" is the part outside of which no training ray
    changes by more than 1/255."""

    auto_window: AutoWindowParams = AutoWindowParams()
    """How `window: auto` is found."""

    opacity: Literal["all", "key_frames"] = "all"
    """Frames by which it is decided where a layer shows, and so how its mesh is made. With "key_frames", those of a
    take in segments, a change of another frame leaves the meshes as they are."""


class ReconstructParams(Section):
    """A surface from the samples of each layer."""

    method: Literal["grid", "poisson"] = "grid"
    """ "grid" takes the samples themselves as vertices; "poisson" is the paper's screened Poisson surface of each
    layer."""

    resolution: TextureSide | None = None
    """Samples a side that are used; null takes all."""

    depth: Annotated[int, Field(ge=4, le=12)] = 7
    """Poisson: depth of the octree."""

    point_weight: Weight = 4.0
    """Poisson: weight of the samples (screening)."""

    trim: Factor = 2.0
    """Poisson: vertices farther than this many local sample spacings from the samples are removed."""

    trim_edges: Factor = 1.5
    """Poisson: vertices within this many mean edges of the samples stay."""


class CollapseParams(Section):
    """The error by which edges of sheets collapse, weighted by how much a place shows."""

    measured_layers: Count = 3
    """Layers that the error is measured on."""

    min_visibility: Share = 0.05
    """Least share of its opacity that a place counts with, however much lies before it."""

    empty_weight: Annotated[float, Field(gt=0, le=1)] = 0.001
    """Weight of a place without opacity."""

    min_area: Annotated[float, Field(gt=0, le=1)] = 0.001
    """Least area of a triangle, as a share of half a grid cell."""

    margin: Natural = 2
    """Triangles this near, in samples, to a place that shows are kept."""


class RefitParams(Section):
    """The fit of the remaining vertices' radii to all samples."""

    stay: Annotated[float, Field(gt=0, le=1e6)] = 0.1
    """Pull towards the sample's own radius, as a share of what the samples around a vertex weigh."""

    min_cosine: Annotated[float, Field(gt=0, le=1)] = 0.02
    """Least cosine that is reckoned with between a normal and the direction to c."""

    empty_weight: Annotated[float, Field(gt=0, le=1)] = 0.0001
    """Weight of a place that never shows."""


class DecimateParams(Section):
    """Fewer vertices where they are missed least."""

    resolution: Literal["auto"] | Annotated[int, Field(ge=8, le=2048)] = "auto"
    """R^m: each layer keeps at most R^m x R^m vertices. "auto" is the least of `auto.candidates` that the photos cannot
    tell from the best."""

    auto: MeshChoiceParams = MeshChoiceParams()
    """How `resolution: auto` is decided."""

    uv: Literal["nearest", "exact"] = "exact"
    """Texture coordinates of Poisson surfaces: of the nearest sample (the paper), or of a vertex's own place in the
    chart."""

    collapse: CollapseParams = CollapseParams()
    """Of sheets (`reconstruct.method: grid`)."""

    refit: RefitParams = RefitParams()
    """Of sheets."""

    aggressiveness: Annotated[Many[Aggressiveness], Field(min_length=1, max_length=10)] = (3, 5, 7)
    """Aggressiveness of the simplification of Poisson surfaces, tried in turn until the target is reached."""


class TextureParams(Section):
    """The layers' textures, as the model has them."""

    resolution: Literal["auto"] | TextureSide = "auto"
    """R^t: texels a side of each layer's texture. "auto" is the least of `auto.candidates` that the photos cannot tell
    from the best."""

    auto: TextureChoiceParams = TextureChoiceParams()
    """How `resolution: auto` is decided."""


class BakeParams(Section):
    """Textures are fitted to the meshes that ship."""

    iterations: Natural = 2
    """Passes over the training cameras' rays, in each frame; 0 leaves the textures as `texture` made them."""

    hold: Weight = 0.008
    """Price of a texel's change from frame to frame, against the error of keeping still. Larger values make smaller
    videos; 0 lets all texels tremble."""

    hold_window: Annotated[int, Field(ge=4, le=1_000_000)] = 96
    """Longest run of frames that are held together. Longer takes are held in overlapping windows."""

    hold_megabytes: Count = 32
    """Memory for a window's frames of one layer, MB; larger ones go through a file."""

    hold_frames: Count = 6
    """Frames in which it is looked how much a texel shows; the greatest counts."""

    moving_views: Count = 2
    """Poses that each training camera is given where the head turns."""

    damping: Annotated[float, Field(gt=0, le=1e6)] = 0.05
    """Added to a texel's sum of weights: what is hardly seen hardly moves."""

    min_light: Share = 0.001
    """Layers behind less transmittance are left out of the fit."""
