"""`sample`, `reconstruct`, `decimate`, `texture` and `bake`: from the model to meshes and textures."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from facefolds_core.params.base import Section, TextureSide, Weight


class SampleParams(Section):
    """Each layer's surface at the nodes of a grid of directions."""

    resolution: Literal["auto"] | TextureSide = "auto"
    """R: each layer is sampled at R x R directions over the window. "auto" is the least multiple of 64 that loses no
    texel of the model, and no less than 512."""

    window: Literal["full", "auto"] = "auto"
    """ "full" is all that the model has (the paper's hemisphere); "auto" is the part outside of which no training ray
    changes by more than 1/255."""


class ReconstructParams(Section):
    """A surface from the samples of each layer."""

    method: Literal["grid", "poisson"] = "grid"
    """ "grid" takes the samples themselves as vertices; "poisson" is the paper's screened Poisson surface of each
    layer."""

    resolution: TextureSide | None = None
    """Samples a side that are used; null takes all."""

    depth: Annotated[int, Field(ge=4, le=12)] = 7
    """Poisson: depth of the octree."""


class DecimateParams(Section):
    """Fewer vertices where they are missed least."""

    resolution: Literal["auto"] | Annotated[int, Field(ge=8, le=2048)] = "auto"
    """R^m: each layer keeps at most R^m x R^m vertices. "auto" is the least of 16, 24, 32, 48 and 64
    that the photos cannot tell from the best."""

    uv: Literal["nearest", "exact"] = "exact"
    """Texture coordinates of Poisson surfaces: of the nearest sample (the paper), or of a vertex's own place in the
    chart."""


class TextureParams(Section):
    """The layers' textures, as the model has them."""

    resolution: Literal["auto"] | TextureSide = "auto"
    """R^t: texels a side of each layer's texture. "auto" is the least of 128, 192, 256, 384, 512
    and 768 that the photos cannot tell from the best."""


class BakeParams(Section):
    """Texels keep still where a change would not show."""

    hold: Weight = 5.0
    """Price of a texel's change from one frame to the next: the squared error, in codes of 255 summed over a picture's
    pixels, that it must at least take away. Larger values make smaller videos; 0 lets all texels tremble."""
