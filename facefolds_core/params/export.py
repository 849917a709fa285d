"""`sample`, `reconstruct`, `decimate`, `texture` and `bake`: from the model to meshes and textures."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from facefolds_core.params.base import Factor, Natural, Section, TextureSide, Weight


class SampleParams(Section):
    """Each layer's surface at the nodes of a grid of directions."""

    resolution: TextureSide = 512
    """R; each layer is sampled at R x R directions over the window."""

    window: Literal["full", "auto"] = "auto"
    """"full" is the whole hemisphere (the paper); "auto" is the part of it outside which no training ray that was
    looked at changes by more than 1/255 (export/window.py)."""


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


class DecimateParams(Section):
    """Fewer vertices where they are missed least."""

    resolution: Annotated[int, Field(ge=8, le=2048)] = 64
    """R^m; each layer keeps at most R^m x R^m vertices."""

    uv: Literal["nearest", "exact"] = "exact"
    """Of Poisson surfaces: "nearest" gives a vertex the texture coordinates of the nearest sample (the paper), "exact"
    those of its own direction from the sphere centre. Vertices of `grid` are samples and keep theirs."""


class TextureParams(Section):
    """The layers' textures, as the model has them."""

    resolution: TextureSide = 512
    """R^t; texels a side of each layer's texture."""


class BakeParams(Section):
    """Textures are fitted to the meshes that ship."""

    iterations: Natural = 2
    """Passes over the training cameras' rays, in each frame; 0 leaves the textures as `texture` made them."""

    hold: Weight = 0.02
    """How dear a change of a texel from one frame to the next is, against the error that keeping still makes in
    training views (export/hold.py); larger values make smaller videos. 0 lets all texels tremble."""
