"""`train.start`, `train.mesh`, `train.geometry`: where the explicit model's layers lie."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator

from facefolds_core.params.base import Count, Factor, Length, Many, Pixels, Section, Share


class StartParams(Section):
    """What the layers take from the volume: centre, window, opacity."""

    centres: Annotated[Many[Annotated[float, Field(ge=-10, le=10)]], Field(min_length=1, max_length=1000)] = (
        *(-0.1, -0.15, -0.2, -0.25),
        *(-0.3, -0.35, -0.4),
    )
    """Candidates for the sphere centre c: (x, 0, 0) with these x, units. The paper's is -0.25."""

    belts: Annotated[Many[Annotated[float, Field(ge=0, le=80)]], Field(max_length=100)] = (10.0,)
    """Degrees below level from which on the rays of the UV map fall no further, but start lower down on the neck's axis
    instead: candidates, tried with each centre beside the plain sphere. They hold a collar under hair."""

    centre_tie: Share = 0.02
    """Of the charts that lose a share of the visible surface within this of the least, the one farthest back wins:
    directions fan out less."""

    centre_nodes: Annotated[int, Field(ge=8, le=4096)] = 96
    """Rows of the coarse radius map, over all (u, v) that a chart may hold, by which charts are compared."""

    window_limit: Annotated[float, Field(ge=0.1, le=1)] = 0.9
    """No window reaches beyond |u| of this: at the poles a radius map has no meaning."""

    column_limit: Annotated[float, Field(ge=0.1, le=1.9)] = 1.5
    """With a belt no window reaches below u of minus this."""

    azimuth_limit: Annotated[float, Field(ge=0.1, le=1.9)] = 1.5
    """No window reaches beyond |v| of this; 1 is straight sideways from c."""

    window_margin: Share = 0.04
    """The window reaches this far in u and v beyond what holds the subject: the volume is coarse."""

    subject_opacity: Share = 0.5
    """Of the volume, from which on a direction is taken to hold the subject."""

    fog_depth: Length = 0.13
    """Median depth over which the subject is spread in the volume, units, from which on it is fog: smooth pale plaster
    is explained as well by fog as by a surface. `studio` has 0.04, `fox` 0.10, `buddha` 0.15."""

    fog_gain: Annotated[float, Field(ge=1, le=1000)] = 10.0
    """Fog is taken to be so many times as dense: its middle lies deep within the subject, and where few cameras look it
    is thin. 1 leaves it as thin."""

    fog_holes: Annotated[float, Field(ge=0, le=1)] = 0.12
    """Units. Holes and dents of such fog that a ball of this radius does not fit into are filled with what was left to
    the room there (at least with `subject.body_depth`): where that is as pale nothing told them apart. 0: none."""

    beside_opacity: Share = 0.3
    """Directions in which the volume is less opaque lie beside the subject: what was painted there is room, and is made
    transparent at the end."""

    min_opacity: Annotated[float, Field(gt=0, lt=1)] = 0.02
    """Of all layers together at the start, at least. Their weights are equal: one alpha for all would favour the outer
    ones, and the rounds of geometry would drift outwards."""

    max_opacity: Annotated[float, Field(gt=0, lt=1)] = 0.9
    """Of all layers together at the start, at most: what is opaque at once never shows the layers within."""

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.max_opacity < self.min_opacity:
            raise ValueError("max_opacity must be at least min_opacity")
        return self


class MeshParams(Section):
    """How far a tracked mesh is believed, where there is one."""

    reach: Length = 0.03
    """Where the volume lies outside the tracked mesh by more, units, it is believed: a mesh knows no hair and no
    clothes. Where it lies deeper it never is: it has holes at dark eyes, open mouths and where few cameras look."""

    max_distance: Length = 0.02
    """In a direction in which the mesh lies farther than this from the volume, units, it is off."""

    max_share_off: Share = 0.5
    """A tracked mesh that is off in more than this share of the directions in which both have a surface is wrong as a
    whole (its scale, its place) and is left out. `actor` and `mugsy` have 0.03 and 0.04; enlarged by 5, 10 and 20 % the
    actor's has 0.53, 0.92 and 1.00, shrunk by 10 % 0.70."""

    nodes: Annotated[int, Field(ge=8, le=4096)] = 128
    """Rows and columns of (u, v), of all that the chart may hold, at which the mesh is compared with the volume."""

    trust: Annotated[float, Field(ge=0, le=10)] = 0.004
    """Where the opacity found is nearer to the tracked mesh than this, the mesh is kept; farther offsets lose as much,
    units."""

    opacity: Share = 0.9
    """At the start where only the tracked mesh says that there is something."""


class GeometryParams(Section):
    """The radius maps of the layers, and the rounds in which they move to the opacity found."""

    nodes: Annotated[int, Field(ge=8, le=4096)] = 384
    """Along the longer side of the radius maps."""

    halfwidth: Annotated[float, Field(gt=0, lt=0.2)] = 0.006
    """The layers lie within this distance of their middle, units, where the volume is sharp: layers farther apart than
    a surface is uncertain show it several times."""

    max_halfwidth: Length = 0.015
    """No layers lie farther from their middle than this, units, however blurred the volume is,"""

    max_halfwidth_pixels: Factor = 8.0
    """nor than so many pixels of the median training camera (but `halfwidth` they may): what lies farther apart shows
    each camera its own picture. In fog `max_halfwidth` alone counts."""

    min_radius: Annotated[float, Field(ge=0.02, le=10)] = 0.08
    """No layer's middle comes nearer to c, units: the search for crossings takes strides of less than half of that."""

    rounds: Annotated[Many[Annotated[float, Field(gt=0, le=100)]], Field(min_length=1, max_length=100)] = (
        2.5,
        1.6,
        1.0,
    )
    """Halfwidths of the rounds of geometry, in halfwidths of the model: each moves the layers to the opacity found."""

    round_iterations: Count = 60
    """Adam steps of each round, at a quarter of the final texels a side."""

    round_stride: Count = 8
    """At most every so-manieth pixel of each camera is looked at in the rounds: their textures are coarse;"""

    round_rays: Count = 250000
    """but so many of all cameras are, where there are as many: with fewer, hair of small pictures becomes lumpy."""

    blur: Pixels = 6.0
    """Smoothing of the layers' motion between rounds, standard deviation, nodes."""
