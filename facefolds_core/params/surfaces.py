"""`train.start`, `train.geometry`: where the explicit model's layers lie."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import Field

from facefolds_core.params.base import Count, Length, Many, Pixels, Section


class StartParams(Section):
    """Charts that are tried for the subject as it was found."""

    centres: Annotated[Many[Annotated[float, Field(ge=-10, le=10)]], Field(min_length=1, max_length=1000)] = (
        *(-0.1, -0.15, -0.2, -0.25),
        *(-0.3, -0.35, -0.4),
    )
    """Candidates for x of the sphere centre c = (x, 0, 0), units. The paper's is -0.25."""

    belts: Annotated[Many[Annotated[float, Field(ge=0, le=80)]], Field(max_length=100)] = (10.0, 30.0)
    """Candidates for a belt, degrees below level, tried with each centre beside the plain sphere. Below it rays start
    lower on the neck's axis."""

    centre_tie: ClassVar[float] = 0.002
    view_tie: ClassVar[float] = 0.015
    """Of the charts within the first of the least loss of visible surface, and within the second of the least loss of
    what the camera sees that loses most, the one farthest back wins."""

    centre_nodes: ClassVar[int] = 96
    """Rows of the coarse radius map by which charts are compared."""

    window_limit: ClassVar[float] = 0.9
    """Largest |u| of a window: at the poles a radius map has no meaning."""

    column_limit: ClassVar[float] = 1.5
    """Largest -u of a window below a belt."""

    azimuth_limit: ClassVar[float] = 1.5
    """Largest |v| of a window; 1 is straight sideways from c."""

    subject_opacity: ClassVar[float] = 0.5
    """Opacity of the subject's Gaussians from which on a direction holds the subject."""


class GeometryParams(Section):
    """The radius maps of the layers, and the rounds in which they move to the opacity found."""

    nodes: Annotated[int, Field(ge=8, le=4096)] = 384
    """Nodes along the longer side of the radius maps."""

    halfwidth: Annotated[float, Field(gt=0, lt=0.2)] = 0.006
    """The layers lie within this distance of their middle, units, where the start is sharp."""

    max_halfwidth: Length = 0.015
    """Largest distance of a layer from the middle, units."""

    rounds: Annotated[Many[Annotated[float, Field(gt=0, le=100)]], Field(min_length=1, max_length=100)] = (
        2.5,
        1.6,
        1.0,
    )
    """Halfwidths of the rounds of geometry, in halfwidths of the model."""

    round_iterations: Count = 60
    """Adam steps of each round."""

    blur: Pixels = 6.0
    """Smoothing of the layers' motion between rounds, standard deviation, nodes. With eight cameras 12 gained,
    with thinner layers."""
