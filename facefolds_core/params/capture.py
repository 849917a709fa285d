"""`capture`, `normalize` and `subject`: what comes before the training."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from facefolds_core.params.base import Count, ImageSide, Section, Seed, Share


class CaptureParams(Section):
    """The embedded actor (ignored for other sources)."""

    cameras: Annotated[int, Field(ge=3, le=100_000)] = 24
    """Number of cameras of the rig."""

    frames: Count = 36
    """Number of frames, evenly spread over `seconds`."""

    seconds: Annotated[float, Field(gt=0, le=3600)] = 1.5
    """Seconds of her take of 4 s that are filmed, from the beginning. Both the take and its first 1.5 s loop."""

    height: ImageSide = 192
    """Height of the images, pixels."""

    width: ImageSide = 128
    """Width of the images, pixels."""

    head_motion: Annotated[float, Field(ge=0, le=45)] = 0.0
    """Degrees by which the head turns to each side, with a nod and a lean of half as much."""

    clutter: Share = 0.0
    """Contrast of tiles of random colours on her room's walls; 0 leaves them as painted."""

    plates: bool = True
    """Film the empty room, too, as studios do: a clean plate a camera."""

    mattes: bool = False
    """Offer the true opacity of all cameras to the training. Else it serves scoring only."""

    @property
    def frame_rate(self) -> float:
        """Frames a second: it plays as fast as it was filmed."""
        return self.frames / self.seconds


class NormalizeParams(Section):
    """From a capture to a scene: cameras, images and tracked mesh in the one convention."""

    long_side: ImageSide = 768
    """Images are reduced to fit into this many pixels along their longer side; they are never enlarged."""

    short_side: ImageSide = 500
    """Images are reduced to fit into this many pixels along their shorter side."""

    max_elevation: Annotated[float, Field(gt=0, le=90)] = 45.0
    """Cameras beyond this elevation, seen from the subject, are culled; degrees."""

    max_azimuth: Annotated[float, Field(gt=0, le=180)] = 90.0
    """Cameras farther to a side, seen from the subject, are culled; degrees."""

    display_colour: bool = False
    """Apply Multiface's display colour correction."""

    stabilize: bool | Literal["auto", "found"] = "auto"
    """Whether the model is made in the head's own frame. true uses the head's poses, false takes the head to stand
    still. "auto" uses them where the head turns by more than 2 degrees or shifts by more than 2 % of its size. "found"
    looks for poses in the pictures, as "auto" does where the capture has no tracked mesh; see
    docs/guide/subjects.md."""


class SubjectParams(Section):
    """The subject is found once: Gaussians of one frame, and every picture's matte. Mattes come from the user
    (`subjects.NAME.mattes`), the capture, clean plates, or else Gaussians and colours. `normalize`, looking for poses,
    takes the defaults."""

    iterations: Annotated[int, Field(ge=1, le=1_000_000)] = 2500
    """Steps in which Gaussians are fitted, a picture each."""

    fewest: Count = 9000
    """Gaussians at the end, at least."""

    most: Count = 30_000
    """Gaussians at the end, at most."""

    seed: Seed = 0
    """Seed of what is left to chance."""
