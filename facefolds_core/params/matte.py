"""`matte`: where the subject is in each picture."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from facefolds_core.params.base import Count, Factor, Length, Natural, Pixels, Section, Share, Weight


class CutOutParams(Section):
    """GrabCut (Rother et al. 2004, OpenCV's) in single pictures, begun from the opacity of the starting volume."""

    long_side: Annotated[int, Field(ge=32, le=4096)] = 384
    """Pictures are reduced to this, pixels: what else is known of the outline is no finer."""

    inside: Share = 0.9
    """Where the volume is more opaque, and `erode` farther in, a pixel is the subject's for sure."""

    outside: Share = 0.3
    """Where it is less opaque, and `dilate` farther out, a pixel is the room's for sure. Of a cluttered room GrabCut
    takes whole tiles that reach into the undecided band; of a dark one the volume keeps fog that is more opaque."""

    erode: Annotated[float, Field(ge=0, lt=0.5)] = 0.01
    """Of the picture's longer side, 4 pixels of 384; the volume is blurred."""

    dilate: Annotated[float, Field(ge=0, lt=0.5)] = 0.006
    """Of the picture's longer side, 2 pixels of 384; the volume may lack hair."""

    iterations: Count = 3
    """Of GrabCut."""


class PlateParams(Section):
    """Pictures beside their clean plates: what differs is the subject, and at its outline by how much it is opaque."""

    blur: Pixels = 0.7
    """Standard deviation by which both are blurred before they are compared, pixels: noise is no difference."""

    different: Share = 0.05
    """Largest difference of a colour, in [0, 1], from which on a pixel may be the subject's."""

    least: Share = 0.05
    """What is smaller than this share of the largest thing is a shadow or a reflection."""

    outline: Natural = 8
    """Pixels inside of the outline up to which opacity is found from colours, before the plate's (of a thin subject
    half its thickness at most): loose hair is as wide on pictures of 384;"""

    beyond: Natural = 6
    """and outside of it: hair."""

    faint: Share = 0.012
    """Difference of a colour from the plate's from which on a pixel beyond the outline may show a little of the
    subject, at least; it is `faint_noise` times the pictures' noise where that is more."""

    faint_noise: Factor = 2.5
    """See `faint`."""

    noise: Weight = 0.01
    """Standard deviation of the pictures' noise, at least: the median difference from the plate far from the subject
    where that is more."""

    quiet: Natural = 12
    """So many pixels beyond the outline the difference is noise."""

    spread: Pixels = 6.0
    """Standard deviation of the neighbourhood whose colours the subject's are taken to have at a pixel of the outline,
    pixels."""

    deviation: Weight = 0.01
    """Standard deviation of these colours, at least: subjects of one colour."""

    alike: Weight = 3.0
    """Logarithm of how much less likely an opacity is that differs by 1 from those around it: decides where subject
    and plate have the same colour."""

    beside: Pixels = 1.5
    """Standard deviation of "around", pixels."""

    solid: Weight = 2.0
    """Logarithm of how much likelier an opacity of 1 is than others: most of a subject is opaque."""

    steps: Annotated[int, Field(ge=2, le=1001)] = 21
    """Opacities from 0 to 1 that are compared."""


class VoteParams(Section):
    """Pictures vote about each voxel: what enough of those that see it take for the subject's is the subject's."""

    share: Annotated[float, Field(gt=0, le=1)] = 0.8
    """Of the pictures that see a voxel; the rest may be wrong."""

    min_views: Count = 3
    """Voxels that fewer pictures see are nobody's; where there are fewer in all, none votes."""

    body_depth: Weight = 0.1
    """Optical depth of a voxel of the starting volume from which on it belongs to the subject's body,"""

    near: Length = 0.04
    """and only what lies within this of the body can be the subject's, units: in the shadow that the head throws for
    all others, one picture's bookshelf would be undisputed."""

    grow: Annotated[float, Field(ge=0, lt=0.5)] = 0.01
    """A cut-out may reach this far beyond the silhouette of what the pictures agree on, in shares of its longer side:
    hair."""

    least: Share = 0.85
    """IoU of a cut-out with that silhouette, in shares of the median picture's, under which the picture is outvoted: it
    has no matte."""


class OutlineParams(Section):
    """How the subject is found in a picture: beside its clean plate, or cut out of it."""

    plates: PlateParams = PlateParams()
    """Of a picture with a clean plate."""

    cut_out: CutOutParams = CutOutParams()
    """Of a picture by itself."""

    vote: VoteParams = VoteParams()
    """Of all pictures."""


class MatteParams(OutlineParams):
    """Where the subject is in each picture: mattes to look at and to correct (`mattes` of a subject). They serve the
    scores of cameras without masks, and the training if it is told so."""

    method: Literal["none", "auto", "plates", "pictures"] = "none"
    """Where the capture has no matte: "none" looks for none; "plates" takes what differs from the camera's clean plate;
    "pictures" fits a starting volume and cuts the subject out of each picture (minutes); "auto" takes plates where
    they are, else pictures."""

    train: Literal["given", "all", "none"] = "given"
    """Which are targets of the starting volume's opacity (`train.volume.matte_weight`): those that came with the
    capture or that `mattes` of the subject names; all, those that were found, too; or none."""
