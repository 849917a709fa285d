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
    """Voxels along a side of the outer zone (`train.room`)."""


class VolumeParams(Section):
    """The volume that the geometry starts from: density and colour on a grid, fitted to the images of one frame."""

    reach: Length = 0.45
    """The volume's box lies within this distance of the origin, units."""

    min_view_share: Share = 0.06
    """Voxels that a smaller share of the training cameras sees are empty."""

    shared_view_share: Share = 0.35
    """Share of the cameras from which on the fog of the start is as thick as `fog` says."""

    fog: Factor = 2.0
    """Optical depth along the box at the start."""

    opacity_weight: Weight = 0.001
    """Weight of the opacity regulariser 1 - T: what the background explains stays clear."""

    binarisation_weight: Weight = 0.003
    """Weight of the binarisation loss t (1 - t), t = min(T, 1/2)."""

    matte_weight: Weight = 0.0
    """Weight of half the squared distance of a ray's opacity from the matte, where there are mattes. The volume is
    coarser than an outline: pressed to it, it lost collars and 1 dB of the actor."""

    smoothness_weight: Weight = 0.001
    """Weight of the smoothness of raw density."""

    learning_rate: Rate = 0.3
    """Learning rate of raw density."""

    colour_learning_rate: Rate = 0.03
    """Learning rate of colours."""

    final_rate: Annotated[float, Field(gt=0, le=1)] = 0.1
    """Part of themselves to which both rates fall along the last level."""

    betas: Betas = (0.9, 0.99)
    """Adam's beta 1 and beta 2."""

    rays: Count = 16384
    """Rays in one step."""

    step: Annotated[float, Field(ge=0.05, le=10)] = 0.7
    """Distance between samples on a ray, voxels."""

    pixel: Pixels = 0.7
    """Images are reduced until a pixel covers this many voxels at the origin."""

    levels: Annotated[Many[VolumeLevel], Field(min_length=1, max_length=16)] = (
        VolumeLevel(resolution=48, iterations=120, room=48),
        VolumeLevel(resolution=96, iterations=120, room=80),
    )
    """Levels of the fit, from coarse to fine."""

    min_contrast: Weight = 0.005
    """A voxel whose rays all differ less from what lies behind, in squared colour distance, is cleared."""

    empty_depth: Annotated[float, Field(gt=0, le=1)] = 0.001
    """Blocks whose voxels all have a smaller optical depth are skipped, for speed."""

    body_depth: Weight = 0.1
    """Optical depth from which on a voxel belongs to a body, before a far sphere."""

    @model_validator(mode="after")
    def _shared_is_more(self) -> Self:
        if self.shared_view_share <= self.min_view_share:
            raise ValueError("shared_view_share must be larger than min_view_share")
        return self


class RoomParams(Section):
    """The outer zone: all space beyond the ball of `volume.reach`. Without a place of its own a near wall becomes fog
    around the head (docs/research/backgrounds-and-rooms.md)."""

    needed_below: Annotated[float, Field(ge=0, le=100)] = 28.0
    """An outer zone is considered where the coarse level has a smaller PSNR without one, dB. 0 is never."""

    asked_cameras: Count = 6
    """One of so many training cameras is left out to decide whether the zone helps."""

    least_gain: Annotated[float, Field(ge=-100, le=100)] = 0.0
    """The outer zone is used if it gains this much on the cameras left out, dB. -100: always."""

    seen_rays: Factor = 1.0
    """Voxels that fewer rays have reached take their neighbours' colours."""

    fog: Factor = 1.0
    """Optical depth at the start, from the ball to infinity."""

    step: Annotated[float, Field(ge=0.05, le=10)] = 0.7
    """Distance between samples on a ray, voxels."""

    farthest: Annotated[float, Field(gt=1, le=1000)] = 20.0
    """What lies farther from the centre, in radii of the ball, is left to the far sphere."""

    smoothness_weight: Weight = 0.001
    """Weight of the smoothness of raw density."""

    betas: Betas = (0.9, 0.99)
    """Adam's beta 1 and beta 2."""


class WallParams(Section):
    """Walls, floors and tables that the subject touches: planes with nothing behind them. Only where there is an outer
    zone."""

    most: Annotated[int, Field(ge=0, le=8)] = 3
    """Walls that are looked for, at most."""

    tolerance: Factor = 1.5
    """Points within so many voxels lie on a plane."""

    spread: Length = 0.12
    """Least standard deviation of a wall's points along it, units."""

    behind: Share = 0.05
    """Largest share of the visible points that may lie behind a wall."""

    margin: Length = 0.05
    """What stands out from a wall by less belongs to it, units."""

    points: Count = 4000
    """Points among which planes are looked for."""

    trials: Count = 1000
    """Planes through three random points that are tried."""

    seed: Natural = 0
    """Seed of the trials."""


class SubjectParams(Section):
    """Which part of the volume is the subject: the body at the cameras' common centre, without walls."""

    near: Length = 0.1
    """Standard deviation of the weight by which bodies near the common centre are preferred, units."""

    body_depth: Weight = 0.03
    """Optical depth from which on a voxel belongs to a body, where there is an outer zone."""

    below: Share = 0.35
    """Directions that fall by more, as a sine, are below, where a subject may go on beyond the ball."""

    larger: Annotated[Many[Length], Field(max_length=8)] = (0.65,)
    """Radii of the ball that are tried in turn where the subject is cut off."""

    max_cut: Share = 0.005
    """The subject is cut off where a larger share of its voxels lies at the edge of the ball."""

    walls: WallParams = WallParams()
    """What it stands on or hangs at."""


class EnvironmentParams(Section):
    """What is behind the room: one blurred picture on a large sphere, shared by all cameras."""

    rows: Annotated[int, Field(ge=2, le=4096)] = 24
    """Texels from pole to pole; twice as many around."""

    radius: Annotated[float, Field(gt=1, le=1000)] = 2.5
    """Radius of the sphere, in distances of the farthest camera from the origin."""

    learning_rate: Rate = 0.02
    """Learning rate of its colours."""

    betas: Betas = (0.9, 0.99)
    """Adam's beta 1 and beta 2."""


class WarningParams(Section):
    """When a training that ended well is said not to be well."""

    min_volume_psnr: Annotated[float, Field(ge=0, le=100)] = 28.0
    """Least PSNR of the starting volume on training rays, dB."""

    max_lost: Share = 0.05
    """Largest share of the visible surface without a place in the chart."""


class CameraParams(Section):
    """What single cameras do differently: exposure and white balance (gains), and calibration that contradicts."""

    min_opacity: Share = 0.95
    """Least opacity of the volume on rays that count."""

    min_rays: Count = 50
    """A camera with fewer opaque rays than this keeps the gain 1."""

    prior: Share = 0.02
    """Uncertainty of colours when gains are fitted, which draws gains towards 1."""

    outlier: Factor = 2.5
    """Rays with a residual beyond this many medians are left out of the second fit."""

    min_gain_spread: Weight = 0.03
    """Gains whose standard deviation over cameras is smaller are taken to be 1."""

    max_error_ratio: Annotated[float, Field(ge=1, le=1e6)] = 2.0
    """A camera with an error over this many medians is left out."""
