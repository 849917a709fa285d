"""`matte`: where the subject is in each picture."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from facefolds_core.params.base import Count, Factor, Length, Natural, Pixels, Section, Share, Weight


class CutOutParams(Section):
    """GrabCut (Rother et al. 2004, OpenCV's) in single pictures, begun from the opacity of the starting volume."""

    long_side: Annotated[int, Field(ge=32, le=4096)] = 512
    """Pictures are reduced to this longer side, pixels."""

    inside: Share = 0.9
    """Opacity of the volume above which a pixel is surely the subject's."""

    outside: Share = 0.3
    """Opacity of the volume below which a pixel is surely the room's."""

    erode: Annotated[float, Field(ge=0, lt=0.5)] = 0.01
    """Distance that a sure pixel of the subject keeps from the outline, as a share of the picture's longer side."""

    dilate: Annotated[float, Field(ge=0, lt=0.5)] = 0.006
    """Distance that a sure pixel of the room keeps from the outline, as a share of the picture's longer side."""

    iterations: Count = 3
    """Iterations of GrabCut."""


class PlateParams(Section):
    """Pictures beside their clean plates: what differs is the subject."""

    blur: Pixels = 0.7
    """Blur of both before they are compared, standard deviation, pixels."""

    different: Share = 0.05
    """Difference of a colour, in [0, 1], above which a pixel may be the subject's."""

    least: Share = 0.05
    """Things smaller than this share of the largest are taken for shadows or reflections."""

    outline: Natural = 8
    """Pixels inside of the outline within which opacity is found from colours."""

    beyond: Natural = 6
    """Pixels outside of the outline within which opacity is found from colours."""

    faint: Share = 0.012
    """Least difference of a colour that shows a little of the subject beyond the outline."""

    faint_noise: Factor = 2.5
    """Least value of `faint` in multiples of the pictures' noise."""

    noise: Weight = 0.01
    """Least standard deviation of noise that is reckoned with."""

    quiet: Natural = 12
    """Noise is measured at least so many pixels beyond the outline."""

    spread: Pixels = 6.0
    """Neighbourhood whose colours the subject is taken to have at the outline, standard deviation, pixels."""

    deviation: Weight = 0.01
    """Least standard deviation of the subject's colours at the outline."""

    alike: Weight = 3.0
    """Price, as a logarithm of likelihood, of an opacity that differs by 1 from those around it."""

    beside: Pixels = 1.5
    """Surroundings of a pixel that `alike` compares, standard deviation, pixels."""

    solid: Weight = 2.0
    """Bonus, as a logarithm of likelihood, of an opacity of 1."""

    steps: Annotated[int, Field(ge=2, le=1001)] = 21
    """Opacities from 0 to 1 that are compared."""


class VoteParams(Section):
    """Pictures vote about each voxel whether it is the subject's."""

    share: Annotated[float, Field(gt=0, le=1)] = 0.8
    """Share of the pictures that see a voxel and must agree."""

    min_views: Count = 3
    """Voxels that fewer pictures see are nobody's."""

    body_depth: Weight = 0.1
    """Optical depth from which on a voxel of the starting volume belongs to the subject's body."""

    near: Length = 0.04
    """Largest distance from the body of a voxel that can be the subject's, units."""

    grow: Annotated[float, Field(ge=0, lt=0.5)] = 0.01
    """How far a cut-out may reach beyond the agreed silhouette, as a share of the longer side."""

    least: Share = 0.85
    """A picture is outvoted if its IoU with that silhouette is below this share of the median picture's."""


class OutlineParams(Section):
    """How the subject is found in a picture: beside its clean plate, or cut out of it."""

    plates: PlateParams = PlateParams()
    """Of a picture with a clean plate."""

    cut_out: CutOutParams = CutOutParams()
    """Of a picture by itself."""

    vote: VoteParams = VoteParams()
    """Of all pictures."""


class MatteParams(OutlineParams):
    """Where the subject is in each picture. Mattes serve the scores of cameras without masks, and the training if it is
    told so."""

    method: Literal["none", "auto", "plates", "pictures"] = "plates"
    """How mattes are found where the capture has none. "plates" compares with clean plates; "pictures" cuts the subject
    out of each picture, which takes minutes; "auto" takes plates where they are, else pictures."""

    train: Literal["given", "all", "none"] = "all"
    """Which mattes training uses: those given with the capture or by `mattes` of the subject, all that were found too,
    or none. Where all training pictures have one, the subject alone is trained, over a colour that changes with each
    step, and no background is learnt."""
