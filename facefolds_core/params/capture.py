"""`capture` and `normalize`."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from facefolds_core.params.base import Count, Factor, FrameRate, ImageSide, Length, Many, Natural, Section, Seed, Share


class CaptureParams(Section):
    """The embedded actor (ignored for other sources)."""

    cameras: Annotated[int, Field(ge=3, le=100_000)] = 24
    """Number of cameras of the rig."""

    frames: Count = 12
    """Number of frames, evenly spread over `seconds`."""

    seconds: Annotated[float, Field(gt=0, le=3600)] = 1.5
    """Seconds of her take of 4 s that are filmed, from the beginning. Both the take and its first 1.5 s loop."""

    height: ImageSide = 192
    """Height of the images, pixels."""

    width: ImageSide = 128
    """Width of the images, pixels."""

    fps: FrameRate | None = None
    """Frames a second at which it is played. null: as fast as it was filmed, frames / seconds."""

    head_motion: Annotated[float, Field(ge=0, le=45)] = 0.0
    """Degrees by which the head turns to each side, with a nod and a lean of half as much."""

    clutter: Share = 0.0
    """Contrast of tiles of random colours on her room's walls; 0 leaves them as painted."""

    seed: Seed = 0
    """Seed of the procedural skin, freckles and hair."""

    plates: bool = False
    """Film the empty room, too: a clean plate a camera."""

    mattes: bool = False
    """Offer the true opacity of all cameras to the training. Else it serves scoring only."""

    @property
    def frame_rate(self) -> float:
        """Frames a second that the film plays at."""
        return self.frames / self.seconds if self.fps is None else self.fps


class MotionParams(Section):
    """`stabilize: auto` stabilises if one of these is exceeded in any frame, against the mean pose."""

    degrees: Annotated[float, Field(ge=0, le=180)] = 2.0
    """Turn of the head, degrees."""

    shift: Annotated[float, Field(ge=0, le=10)] = 0.02
    """Shift of the head, as a share of the tracked mesh's largest extent."""


class RegistrationParams(Section):
    """How poses are found from the pictures (training/registration.py)."""

    stride: Count = 3
    """Every n-th pixel of the reference frame's pictures that shows the subject is a point."""

    scales: Annotated[Many[Share], Field(min_length=1)] = (0.032, 0.016, 0.008, 0.004)
    """Blurs from coarse to fine, standard deviations as shares of the picture's shorter side."""

    rounds: Natural = 3
    """How often the depth of the points is corrected and all frames are aligned anew."""

    max_deeper: Length = 0.01
    """Largest correction of depth, units."""

    steps: Count = 12
    """Gauss-Newton steps a scale, at most."""

    enough: Annotated[float, Field(gt=0, le=1)] = 2e-5
    """A scale ends with a smaller step than this, radians and units."""

    damping: Share = 0.001
    """Added to the normal equations, as a share of their diagonal."""

    outlier: Factor = 2.0
    """Residual, in medians, at which a point counts half."""

    min_opacity: Share = 0.9
    """Least opacity of the volume on a ray that gives a point."""

    min_cosine: Share = 0.3
    """Least cosine between a point's normal and the direction to the camera."""

    min_points: Count = 200
    """A frame with fewer points gets no pose."""

    min_likeness: Share = 0.6
    """A frame is refused, and its pose bridged, if it correlates with the reference less than this share of the median
    frame."""

    max_leap: Annotated[float, Field(gt=0, le=180)] = 8.0
    """A frame is refused if its pose lies more degrees than this from the middle of its neighbours'."""


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
    still, "auto" decides by `normalize.motion`. "found" looks for poses in the pictures, as "auto" does where the
    capture has no tracked mesh. See docs/guide/subjects.md."""

    motion: MotionParams = MotionParams()
    """How much motion of the head is much."""

    registration: RegistrationParams = RegistrationParams()
    """How poses are found where the capture has none."""
