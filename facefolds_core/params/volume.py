"""`train.volume`, `train.environment`, `train.cameras`: what the explicit model learns before it has surfaces."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator

from facefolds_core.params.base import (
    Betas,
    Count,
    Factor,
    Length,
    Many,
    Natural,
    Pixels,
    Rate,
    Section,
    Share,
    Weight,
)


class VolumeLevel(Section):
    """One stretch of the fit of the volume."""

    resolution: Annotated[int, Field(ge=8, le=1024)]
    """Voxels along the longest side."""

    iterations: Count
    """Adam steps."""

    room: Annotated[int, Field(ge=8, le=512)] = 64
    """Voxels along a side of the outer zone (`train.room`), coarser than the volume's: it shows what is behind."""


class VolumeParams(Section):
    """The volume that the geometry starts from: density and colour on a grid, fitted to the images of one frame."""

    reach: Length = 0.45
    """The box lies within this distance of the origin, units: a head, hair, neck and the upper chest; cameras are about
    1 away."""

    min_view_share: Share = 0.06
    """Voxels that a smaller share of the training cameras sees are empty: what only one camera sees can be anything."""

    shared_view_share: Share = 0.35
    """Where at least this share of the cameras sees a voxel, the fog of the start is as thick as `fog` says; it falls
    to nothing where only `min_view_share` of them do. What few cameras see must show that it is there: a dark room
    would stay as dark fog."""

    fog: Factor = 2.0
    """Optical depth along the box at the start: thick enough to be shaped, thin enough to see what is behind."""

    opacity_weight: Weight = 0.001
    """Of the opacity regulariser, the sum over rays of 1 - T (T: a ray's transmittance): what the background explains
    stays clear."""

    binarisation_weight: Weight = 0.003
    """Of the binarisation loss, the sum over rays of t (1 - t), t = min(T, 1/2): a face is solid."""

    matte_weight: Weight = 0.3
    """Of half the squared distance of a ray's opacity from the capture's matte, where it has mattes. Colours may be off
    by 0.1, opacities are known: what is beside the subject is empty, whatever it looks like."""

    smoothness_weight: Weight = 0.001
    """Of the sum of sqrt(1 + d^2) over differences d of raw density between neighbours."""

    learning_rate: Rate = 0.3
    """Of raw density, Adam's: it moves over twenty units and has 240 steps."""

    colour_learning_rate: Rate = 0.03
    """Of colours, Adam's."""

    final_rate: Annotated[float, Field(gt=0, le=1)] = 0.1
    """To this part of themselves both rates fall along the last level."""

    betas: Betas = (0.9, 0.99)
    """Adam's beta 1 and beta 2: shares of the moments that a step keeps. The second is lower than the usual 0.999:
    there are 240 steps."""

    rays: Count = 16384
    """In one step."""

    step: Annotated[float, Field(ge=0.05, le=10)] = 0.7
    """Between samples on a ray, voxels: no voxel is stepped over."""

    pixel: Pixels = 0.7
    """Images are reduced until a pixel covers this many voxels at the origin: finer ones say nothing to such a grid."""

    levels: Annotated[Many[VolumeLevel], Field(min_length=1, max_length=16)] = (
        VolumeLevel(resolution=48, iterations=120, room=48),
        VolumeLevel(resolution=96, iterations=120, room=80),
    )
    """From coarse to fine: the coarse one finds where the subject is, the fine one its outline."""

    min_contrast: Weight = 0.005
    """Squared colour distance, summed over channels, from what lies behind: a voxel whose rays are all nearer to it is
    cleared. It explains nothing that the background does not, as a dark shell before a dark wall."""

    empty_depth: Annotated[float, Field(gt=0, le=1)] = 0.001
    """Blocks whose voxels all have a smaller optical depth a voxel are skipped: speed."""

    body_depth: Weight = 0.1
    """Optical depth of a voxel from which on it belongs to a body, before a far sphere; else `train.subject`'s."""

    @model_validator(mode="after")
    def _shared_is_more(self) -> Self:
        if self.shared_view_share <= self.min_view_share:
            raise ValueError("shared_view_share must be larger than min_view_share")
        return self


class RoomParams(Section):
    """The outer zone: density and colour of all space beyond the ball of `volume.reach`, contracted towards infinity. A
    near wall has parallax; without a place of its own it becomes fog around the head. Rates are the volume's."""

    needed_below: Annotated[float, Field(ge=0, le=100)] = 28.0
    """There is an outer zone only where the coarse level has a smaller PSNR without one, dB; 0 is never. Before plain
    walls it has 30 to 33 and an outer zone explains nothing better, but takes up hair and highlights of the subject;
    before near, bright or patterned ones it has 20 to 26 (docs/research/backgrounds-and-rooms.md). Then it is asked:"""

    asked_cameras: Count = 6
    """one of so many training cameras, at least one, is left out of two fits of the coarse level,"""

    least_gain: Annotated[float, Field(ge=-100, le=100)] = 0.0
    """and there is an outer zone only if it shows these better by so much, dB. -100: always."""

    seen_rays: Factor = 1.0
    """Colours of voxels that fewer rays have reached are those of their neighbours: behind the head there would be
    a picture of the face, left from when the head was fog."""

    fog: Factor = 1.0
    """Optical depth at the start, from the ball to infinity: half of the volume's, behind which it lies."""

    step: Annotated[float, Field(ge=0.05, le=10)] = 0.7
    """Between samples on a ray, voxels: no voxel is stepped over."""

    farthest: Annotated[float, Field(gt=1, le=1000)] = 20.0
    """What lies farther from the centre, in radii of the ball, is left to the far sphere: nothing moves there."""

    smoothness_weight: Weight = 0.001
    """Of the sum of sqrt(1 + d^2) over differences d of raw density between neighbours."""

    betas: Betas = (0.9, 0.99)
    """Adam's beta 1 and beta 2: shares of the moments that a step keeps; the volume's."""


class WallParams(Section):
    """Walls, floors and tables that the subject touches: planes with nothing behind them. Looked for only where there
    is an outer zone."""

    most: Annotated[int, Field(ge=0, le=8)] = 3
    """As many are looked for; 0 looks for none."""

    tolerance: Factor = 1.5
    """Points within so many voxels lie on a plane: a surface is three voxels thick in the volume."""

    spread: Length = 0.12
    """Standard deviation of a wall's points along it, the smaller of the two, units: the flattest parts of heads have
    0.1."""

    behind: Share = 0.05
    """Of all visible points that may lie behind a wall. Planes through heads have 6 % and more behind them."""

    margin: Length = 0.05
    """What stands out from a wall by less belongs to it, units: panelling, a shield that a trophy is mounted on."""

    points: Count = 4000
    """In the sample among which planes are looked for; with fewer there are none."""

    trials: Count = 1000
    """Planes through three random points that are tried (RANSAC): one of them lies on a wall that a fifth of the points
    belongs to, but for one time in three thousand."""

    seed: Natural = 0
    """Of the trials."""


class SubjectParams(Section):
    """Which part of the volume is the subject: the body at the cameras' common centre, without the walls it touches."""

    near: Length = 0.1
    """Standard deviation of the weight, over the distance from the common centre, by which bodies are compared, units:
    half a head."""

    body_depth: Weight = 0.03
    """Optical depth of a voxel from which on it belongs to a body, where there is an outer zone: smooth pale surfaces
    are faint (of a plaster head 0.1 loses chin and cheeks), and the room no longer stands around the subject as fog."""

    below: Share = 0.35
    """Directions that fall by more (the sine) are below: there a subject goes on beyond the ball."""

    larger: Annotated[Many[Length], Field(max_length=8)] = (0.65,)
    """Radii of the ball that are tried one after the other where the subject is cut off by `volume.reach`; only
    where there is an outer zone."""

    max_cut: Share = 0.005
    """Share of the subject's voxels at the edge of the ball, not below, above which it is cut off."""

    walls: WallParams = WallParams()
    """What it stands on or hangs at."""


class EnvironmentParams(Section):
    """What is behind the room: one blurred picture on a large sphere, shared by all cameras."""

    rows: Annotated[int, Field(ge=2, le=4096)] = 24
    """Texels from pole to pole; twice as many around. Few: it may take up walls, not the subject."""

    radius: Annotated[float, Field(gt=1, le=1000)] = 2.5
    """Of the sphere around the scene's origin, in distances of the farthest camera from it."""

    learning_rate: Rate = 0.02
    """Of its colours, Adam's."""

    betas: Betas = (0.9, 0.99)
    """Adam's beta 1 and beta 2: shares of the moments that a step keeps; the volume's."""


class WarningParams(Section):
    """When a training that ended well is said not to be well: a line in the terminal and in fit.json."""

    min_volume_psnr: Annotated[float, Field(ge=0, le=100)] = 28.0
    """Of the starting volume on training rays, dB. 30 to 36 where the result is good, 20 to 27 where spikes stood
    around the head or ears were cut off."""

    max_lost: Share = 0.05
    """Share of the visible surface without a place before the chosen centre."""


class CameraParams(Section):
    """What single cameras do differently: exposure and white balance (gains), and calibration that contradicts."""

    min_opacity: Share = 0.95
    """Of the volume on rays that count: what is behind is no surface that several cameras see alike."""

    min_rays: Count = 50
    """A camera with fewer such rays keeps the gain 1."""

    prior: Share = 0.02
    """Colours are taken to be uncertain by this much when the gains are fitted: it draws gains towards 1, those of dark
    subjects most."""

    outlier: Factor = 2.5
    """Rays with a residual larger than this many times the camera's median are left out of the second fit: silhouettes,
    highlights, hair."""

    min_gain_spread: Weight = 0.03
    """Standard deviation of the gains over cameras below which they are taken to be all 1: it may be the fit's own
    error."""

    max_error_ratio: Annotated[float, Field(ge=1, le=1e6)] = 2.0
    """A camera whose error is over so many times the median camera's is left out."""
