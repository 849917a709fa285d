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
    """Largest change of a looked-at ray's colour by what is left out: one step of an 8-bit image."""

    rays_per_camera: Count = 2500
    """Size of the lattice of rays laid over each image, at most: 50 x 50."""

    frames: Count = 3
    """Frames that are looked at, evenly spread: the first, the middle and the last."""

    moving_views: Count = 3
    """Frames of each training camera that are looked at where the head turns: it shows other sides in each."""

    margin: Factor = 2.0
    """On each side, in steps of the lattice of rays on the surface: it covers what lies between the rays."""


class SampleParams(Section):
    """Each layer's surface at the nodes of a grid of directions."""

    resolution: Literal["auto"] | TextureSide = "auto"
    """R; each layer is sampled at R x R directions over the window. "auto": the least multiple of 64 with at least as
    many rows and columns as the model's own texels have there, and `least`."""

    least: TextureSide = 512
    """R that `auto` takes at least: textures of 256 x 256 that were fitted to 512 x 512 samples take fewer bytes than
    those that were fitted to 256 x 256."""

    window: Literal["full", "auto"] = "auto"
    """"full" is all that the model has (the paper: the whole hemisphere); "auto" is the part of it outside which no
    training ray that was looked at changes by more than 1/255 (export/window.py)."""

    auto_window: AutoWindowParams = AutoWindowParams()
    """How `window: auto` is found."""

    opacity: Literal["all", "key_frames"] = "all"
    """Frames by which it is found out where a layer shows: meshes are fine there, and have no triangle where it never
    does. "all": any frame that changes changes all meshes, and all that is baked and encoded after them. "key_frames":
    those of the base of a take in segments, so that a change of another frame costs what it touches; frames are
    mixtures of them to begin with (of 60 frames 0.01 % of the samples that show did not in a key frame, with an alpha
    of 1/255)."""


class ReconstructParams(Section):
    """A surface from the samples of each layer."""

    method: Literal["grid", "poisson"] = "grid"
    """"grid" takes the samples themselves as vertices; "poisson" is the paper's screened Poisson surface of each layer,
    trimmed to the sampled sheet."""

    resolution: TextureSide | None = None
    """Samples a side that are used (the R x R grid is thinned to it); null takes all."""

    depth: Annotated[int, Field(ge=4, le=12)] = 7
    """Poisson: of the octree, 2^depth cells along the longest side of the layer's bounding box and a tenth."""

    point_weight: Weight = 4.0
    """Poisson: of the samples (screening)."""

    trim: Factor = 2.0
    """Poisson: vertices farther than this many local sample spacings from the samples are removed."""

    trim_edges: Factor = 1.5
    """Poisson: the sheet's rim is never cut closer than this many mean edges of the surface: where its triangles are
    larger than the sample spacing, a smaller distance would cut off the rim's triangles although they cover samples."""


class CollapseParams(Section):
    """The error by which edges of sheets collapse, weighted by how much a place shows (export/collapse.py)."""

    measured_layers: Count = 3
    """Layers that the error is measured on, each for its share of all: neighbours are nearly parallel."""

    min_visibility: Share = 0.05
    """Share of its opacity that a place counts with at least, however much lies before it."""

    empty_weight: Annotated[float, Field(gt=0, le=1)] = 0.001
    """What a place without opacity counts: it orders the collapses there."""

    min_area: Annotated[float, Field(gt=0, le=1)] = 0.001
    """A triangle keeps this share of a grid cell's half: it must not degenerate."""

    margin: Natural = 2
    """A triangle is kept if it comes this near, in samples, to one that is not transparent in all frames: filters reach
    across a texel."""


class RefitParams(Section):
    """The fit of the radii at the vertices that are left to all samples (export/refit.py)."""

    stay: Annotated[float, Field(gt=0, le=1e6)] = 0.1
    """Pull towards the sample's own radius, in shares of what the samples around a vertex weigh."""

    min_cosine: Annotated[float, Field(gt=0, le=1)] = 0.02
    """Between a normal and the direction to c, at least: a steep place may be off along the direction without being
    off, but it counts something."""

    empty_weight: Annotated[float, Field(gt=0, le=1)] = 0.0001
    """What a place that never shows weighs."""


class DecimateParams(Section):
    """Fewer vertices where they are missed least."""

    resolution: Literal["auto"] | Annotated[int, Field(ge=8, le=2048)] = "auto"
    """R^m, 8 to 2048; each layer keeps at most R^m x R^m vertices. "auto" is the least of `auto.candidates` that the
    photos cannot tell from the best."""

    auto: MeshChoiceParams = MeshChoiceParams()
    """How `resolution: auto` is decided."""

    uv: Literal["nearest", "exact"] = "exact"
    """Of Poisson surfaces: "nearest" gives a vertex the texture coordinates of the nearest sample (the paper), "exact"
    those of its own place in the chart. Vertices of `grid` are samples and keep theirs."""

    collapse: CollapseParams = CollapseParams()
    """Of sheets (`reconstruct.method: grid`)."""

    refit: RefitParams = RefitParams()
    """Of sheets."""

    aggressiveness: Annotated[Many[Aggressiveness], Field(min_length=1, max_length=10)] = (3, 5, 7)
    """Of Poisson surfaces: of the simplification, tried in turn: the least that reaches the target is best. 3 does for
    all but a handful of vertices."""


class TextureParams(Section):
    """The layers' textures, as the model has them."""

    resolution: Literal["auto"] | TextureSide = "auto"
    """R^t, 8 to 4096; texels a side of each layer's texture. "auto" is the least of `auto.candidates` that the photos
    cannot tell from the best."""

    auto: TextureChoiceParams = TextureChoiceParams()
    """How `resolution: auto` is decided."""


class BakeParams(Section):
    """Textures are fitted to the meshes that ship."""

    iterations: Natural = 2
    """Passes over the training cameras' rays, in each frame; 0 leaves the textures as `texture` made them."""

    hold: Weight = 0.008
    """How dear a change of a texel from one frame to the next is, against the error that keeping still makes in
    training views (export/hold.py); larger values make smaller videos. 0 lets all texels tremble."""

    hold_window: Annotated[int, Field(ge=4, le=1_000_000)] = 96
    """Frames that are held together, at most: longer takes are held in overlapping windows, so that a frame that
    changes changes only those near it. Of each, the inner half counts."""

    hold_megabytes: Count = 32
    """Memory for a window's frames of one layer while they are held; larger ones go through a file, block by block."""

    hold_frames: Count = 6
    """Frames, evenly spread, in which it is looked how much a texel shows; the greatest counts."""

    moving_views: Count = 2
    """Frames whose pose each training camera is given where the head turns: memory and time grow with them, and the
    rays need to meet each texel only."""

    damping: Annotated[float, Field(gt=0, le=1e6)] = 0.05
    """Added to a texel's sum of weights in each step: what is hardly seen hardly moves."""

    min_light: Share = 0.001
    """Layers behind less transmittance are left out of the fit, ray by ray: speed, a quarter of a code of a pixel."""
