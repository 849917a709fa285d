"""`capture` and `normalize`."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from facefolds_core.params.base import Count, FrameRate, ImageSide, Section, Seed


class CaptureParams(Section):
    """The embedded actor (ignored for other sources)."""

    cameras: Annotated[int, Field(ge=3, le=100_000)] = 24
    """Number of cameras of the rig."""

    frames: Count = 12
    """Number of frames: one period of its motion."""

    height: ImageSide = 192
    """Of the images, pixels."""

    width: ImageSide = 128
    """Of the images, pixels."""

    fps: FrameRate = 30.0
    """Frames a second."""

    head_motion: Annotated[float, Field(ge=0, le=45)] = 0.0
    """Degrees by which the head turns to each side as it performs, with a nod of half as much."""

    seed: Seed = 0
    """Of the procedural skin, freckles and hair."""

    plates: bool = False
    """Film the empty room, too: a clean plate a camera. Off, so that results stay what they were."""

    mattes: bool = False
    """Offer the true opacity of all cameras to the training. Off: it serves scoring only, as in a real capture."""


class MotionParams(Section):
    """When `stabilize: auto` stabilises: if either is exceeded in any frame, against the mean pose."""

    degrees: Annotated[float, Field(ge=0, le=180)] = 2.0
    """Turn of the head."""

    shift: Annotated[float, Field(ge=0, le=10)] = 0.02
    """Shift of the head, shares of the tracked mesh's largest extent (of a head about 5 mm)."""


class NormalizeParams(Section):
    """From a capture to a scene: cameras, images and tracked mesh in the one convention."""

    long_side: ImageSide = 768
    """Images are area-downsampled to fit into this box, pixels (aspect kept, never enlarged)."""

    short_side: ImageSide = 500
    """The box's other side, pixels."""

    max_elevation: Annotated[float, Field(gt=0, le=90)] = 45.0
    """Cameras beyond are culled; degrees, seen from the subject."""

    max_azimuth: Annotated[float, Field(gt=0, le=180)] = 90.0
    """Cameras beyond are culled; degrees, seen from the subject: layers before a centre know no back of a head."""

    display_colour: bool = False
    """Apply Multiface's display colour correction."""

    stabilize: bool | Literal["auto"] = "auto"
    """Whether the model is made in the head's own frame: true moves each frame's cameras by the head's pose, false
    takes the head to stand still, "auto" decides by `motion`. Where the poses of the capture are all alike, those are
    taken that lay its tracked meshes over one another. See docs/guide/subjects.md."""

    motion: MotionParams = MotionParams()
    """How much motion of the head is much."""
