"""`capture` and `normalize`."""

from __future__ import annotations

from typing import Annotated

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

    seed: Seed = 0
    """Of the procedural skin, freckles and hair."""

    plates: bool = False
    """Film the empty room, too: a clean plate a camera. Off, so that results stay what they were."""

    mattes: bool = False
    """Offer the true opacity of all cameras to the training. Off: it serves scoring only, as in a real capture."""


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

    stabilize: bool = False
    """Move each frame's cameras by the head pose so that the head stands still. Cameras then move from frame to frame,
    which the static background and held-out scoring do not expect: see docs/guide/subjects.md."""
