"""`train.mattes`: where the subject is in each picture."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from facefolds_core.params.base import Count, Length, Natural, Section, Share, Weight


class CutOutParams(Section):
    """GrabCut (Rother et al. 2004, OpenCV's) in single pictures, begun from the opacity of the starting volume."""

    long_side: Annotated[int, Field(ge=32, le=4096)] = 384
    """Pictures are reduced to this, pixels: the volume that the mattes serve is coarser still."""

    inside: Share = 0.9
    """Where the volume is more opaque, and `erode` farther in, a pixel is the subject's for sure."""

    outside: Share = 0.1
    """Where it is less opaque, and `dilate` farther out, a pixel is the room's for sure."""

    erode: Natural = 4
    """Pixels; the volume is blurred."""

    dilate: Natural = 7
    """Pixels; the volume may lack hair."""

    iterations: Count = 3
    """Of GrabCut."""


class VoteParams(Section):
    """Pictures vote about each voxel: what enough of those that see it take for the subject's is the subject's."""

    share: Annotated[float, Field(gt=0, le=1)] = 0.8
    """Of the pictures that see a voxel; the rest may be wrong."""

    min_views: Count = 3
    """Voxels that fewer pictures see are nobody's."""

    body_depth: Weight = 0.1
    """Optical depth of a voxel of the starting volume from which on it belongs to the subject's body,"""

    near: Length = 0.04
    """and only what lies within this of the body can be the subject's, units: in the shadow that the head throws for
    all others, one picture's bookshelf would be undisputed."""

    grow: Natural = 4
    """A cut-out may reach this far beyond the silhouette of what the pictures agree on, pixels: hair."""

    least: Share = 0.85
    """IoU of a cut-out with that silhouette, in shares of the median picture's, under which the picture is outvoted: it
    has no matte."""


class MatteParams(Section):
    """How `facefolds mattes` cuts the subject out of the pictures. No training reads it."""

    cut_out: CutOutParams = CutOutParams()
    """In each picture."""

    vote: VoteParams = VoteParams()
    """Of all pictures."""
