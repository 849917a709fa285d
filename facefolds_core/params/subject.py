"""`subjects`: where a capture is, what of it to use, and overrides of the stages' sections."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field

from facefolds_core.params.base import Coordinate, Count, FrameRate, Many, Natural, Pair, Section, Triple
from facefolds_core.registry import SOURCES

if TYPE_CHECKING:
    SourceName = str
else:
    SourceName = Literal[SOURCES.names]

Raw = dict[str, Any]
"""Keys and values of a section, checked once merged with the section itself."""


class HoldoutEvery(Section):
    """Every n-th camera, in the order of the capture: of those that remain after culling, or of those not held out."""

    every: Annotated[int, Field(ge=2, le=100_000)]
    """Counted from 1."""


class FrameRange(Section):
    """Which frames of a segment to use: positions in its sorted list of frames, as in Python's range."""

    start: Natural = 0
    """First position."""

    stop: Count | None = None
    """One past the last position; null means to the end."""

    step: Count = 1
    """Take every step-th frame."""


class Overrides(Section):
    """Stage sections that a subject may override, key by key."""

    capture: Raw = Field(default_factory=dict)
    """See `capture`."""

    normalize: Raw = Field(default_factory=dict)
    """See `normalize`."""

    subject: Raw = Field(default_factory=dict)
    """See `subject`."""

    train: Raw = Field(default_factory=dict)
    """See `train`."""

    sample: Raw = Field(default_factory=dict)
    """See `sample`."""

    reconstruct: Raw = Field(default_factory=dict)
    """See `reconstruct`."""

    decimate: Raw = Field(default_factory=dict)
    """See `decimate`."""

    texture: Raw = Field(default_factory=dict)
    """See `texture`."""

    bake: Raw = Field(default_factory=dict)
    """See `bake`."""

    compress: Raw = Field(default_factory=dict)
    """See `compress`."""

    evaluate: Raw = Field(default_factory=dict)
    """See `evaluate`."""


class Subject(Overrides):
    """One entry of `subjects`: where a capture is, what of it to use, and overrides of stage sections."""

    source: SourceName
    """The layout of the capture; "actor" is generated."""

    path: str
    """Folder of the capture; for "actor" the generator's package."""

    segment: str | None = None
    """A capture's segment (Multiface), sequence or performance; null takes the only one."""

    frames: FrameRange | Many[str] | None = None
    """A range of positions, or a list of frame names; null takes all."""

    holdout: Many[str] | HoldoutEvery = HoldoutEvery(every=12)
    """Camera names, or {every: n}: cameras for scoring only. [] holds out none."""

    validation: Annotated[Many[str] | HoldoutEvery | None, Field(alias="validate")] = None
    """Camera names, or {every: n} of the others: set aside from training and scored apart, while something is to be
    chosen. null trains on all."""

    front: str | None = None
    """For captures without a tracked mesh, a camera that faces the subject upright; null finds the front."""

    centre: Triple[Coordinate] | None = None
    """[x, y, z], the subject's middle in the capture's coordinates; null finds it. `normalize` draws it over the
    pictures (scene/place.png)."""

    radius: Annotated[float, Field(gt=0, le=1e9)] | None = None
    """Radius of the ball about the centre that holds the subject, in the capture's unit of length; null takes a ball
    of 45 cm about a head, and what goes on from there towards the cameras."""

    mattes: str | None = None
    """Folder of mattes of the scene's pictures, CAMERA.png or CAMERA/FRAME.png. They take the place of the capture's
    own or of found ones. Relative paths start at the project's folder."""

    start: str | None = None
    """A PLY file of Gaussians (3DGS, as gsplat, nerfstudio, OpenSplat and Postshot write it) in the capture's
    coordinates, of the middle frame, or of that nearest a turning head's mean pose. They take
    the place of those that the stage `subject` fits."""

    krt_size: Pair[Count] | None = None
    """[width, height], pixels, of the images that KRT refers to; null finds out."""

    pixel_centres: Annotated[float, Field(ge=0, le=0.5, multiple_of=0.5)] | None = None
    """Where the capture's K puts the centre of the first pixel, 0 or 0.5; null takes the source's habit."""

    fps: FrameRate | None = None
    """Frames a second; null takes the source's (30 for Multiface, a video's own)."""

    @property
    def is_generated(self) -> bool:
        """Whether the stage `capture` makes the capture, so that it is read from there and not from `path`."""
        return self.source == "actor"
