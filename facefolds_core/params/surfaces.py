"""`train.start`, `train.mesh`, `train.geometry`: where the explicit model's layers lie."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator

from facefolds_core.params.base import Count, Factor, Length, Many, Pixels, Section, Share


class StartParams(Section):
    """What the layers take from the subject as it was found: centre, window, opacity."""

    centres: Annotated[Many[Annotated[float, Field(ge=-10, le=10)]], Field(min_length=1, max_length=1000)] = (
        *(-0.1, -0.15, -0.2, -0.25),
        *(-0.3, -0.35, -0.4),
    )
    """Candidates for x of the sphere centre c = (x, 0, 0), units. The paper's is -0.25."""

    belts: Annotated[Many[Annotated[float, Field(ge=0, le=80)]], Field(max_length=100)] = (10.0,)
    """Candidates for a belt, degrees below level, tried with each centre beside the plain sphere. Below it rays start
    lower on the neck's axis."""

    centre_tie: Share = 0.02
    """Of the charts within this of the least loss of visible surface, the one farthest back wins."""

    centre_nodes: Annotated[int, Field(ge=8, le=4096)] = 96
    """Rows of the coarse radius map by which charts are compared."""

    window_limit: Annotated[float, Field(ge=0.1, le=1)] = 0.9
    """Largest |u| of a window: at the poles a radius map has no meaning."""

    column_limit: Annotated[float, Field(ge=0.1, le=1.9)] = 1.5
    """Largest -u of a window below a belt."""

    azimuth_limit: Annotated[float, Field(ge=0.1, le=1.9)] = 1.5
    """Largest |v| of a window; 1 is straight sideways from c."""

    window_margin: Share = 0.04
    """Margin of the window in u and v beyond what holds the subject."""

    subject_opacity: Share = 0.5
    """Opacity of the subject's Gaussians from which on a direction holds the subject."""

    beside_opacity: Share = 0.3
    """Directions in which they are less opaque lie beside the subject and become transparent."""

    min_opacity: Annotated[float, Field(gt=0, lt=1)] = 0.02
    """Least opacity of all layers together at the start."""

    max_opacity: Annotated[float, Field(gt=0, lt=1)] = 0.9
    """Largest opacity of all layers together at the start, so that inner layers are seen."""

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.max_opacity < self.min_opacity:
            raise ValueError("max_opacity must be at least min_opacity")
        return self


class MeshParams(Section):
    """How far a tracked mesh is believed, where there is one."""

    reach: Length = 0.03
    """Where the Gaussians lie outside the tracked mesh by more, units, they are believed: a mesh knows no hair."""

    max_distance: Length = 0.02
    """A direction in which mesh and Gaussians lie farther apart, units, is off."""

    max_share_off: Share = 0.5
    """A mesh that is off in more than this share of the directions is left out."""

    nodes: Annotated[int, Field(ge=8, le=4096)] = 128
    """Rows and columns of (u, v) at which mesh and Gaussians are compared."""

    trust: Annotated[float, Field(ge=0, le=10)] = 0.004
    """The mesh is kept where the opacity found lies nearer than this, units; farther offsets lose as much."""

    opacity: Share = 0.9
    """Opacity at the start where only the tracked mesh has a surface."""


class GeometryParams(Section):
    """The radius maps of the layers, and the rounds in which they move to the opacity found."""

    nodes: Annotated[int, Field(ge=8, le=4096)] = 384
    """Nodes along the longer side of the radius maps."""

    halfwidth: Annotated[float, Field(gt=0, lt=0.2)] = 0.006
    """The layers lie within this distance of their middle, units, where the start is sharp."""

    max_halfwidth: Length = 0.015
    """Largest distance of a layer from the middle, units."""

    max_halfwidth_pixels: Factor = 8.0
    """Largest distance of a layer from the middle, pixels of the median camera; `halfwidth` is always allowed."""

    min_radius: Annotated[float, Field(ge=0.02, le=10)] = 0.08
    """Least radius of a layer's middle, units."""

    rounds: Annotated[Many[Annotated[float, Field(gt=0, le=100)]], Field(min_length=1, max_length=100)] = (
        2.5,
        1.6,
        1.0,
    )
    """Halfwidths of the rounds of geometry, in halfwidths of the model."""

    round_iterations: Count = 60
    """Adam steps of each round."""

    round_stride: Count = 8
    """At most every n-th pixel is looked at in the rounds."""

    round_rays: Count = 250000
    """Rays of all cameras that are looked at in the rounds, at least."""

    blur: Pixels = 6.0
    """Smoothing of the layers' motion between rounds, standard deviation, nodes."""
