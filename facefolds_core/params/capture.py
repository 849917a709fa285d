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
    """Of its take that are filmed, from the beginning. The take is 4 s long and loops; so do its first 1.5 s, a
    greeting, a blink and a smile. Twelve frames of them are eight a second: each sound is seen, and the film is small.
    """

    height: ImageSide = 192
    """Of the images, pixels."""

    width: ImageSide = 128
    """Of the images, pixels."""

    fps: FrameRate | None = None
    """Frames a second at which it is played. null: as fast as it was filmed, frames / seconds."""

    head_motion: Annotated[float, Field(ge=0, le=45)] = 0.0
    """Degrees by which the head turns to each side as it performs, with a nod and a lean of half as much."""

    clutter: Share = 0.0
    """Of her room's walls, 0 as painted, 1 tiles of random colours at full contrast: what is hard behind a head."""

    seed: Seed = 0
    """Of the procedural skin, freckles and hair."""

    plates: bool = False
    """Film the empty room, too: a clean plate a camera. Off, so that results stay what they were."""

    mattes: bool = False
    """Offer the true opacity of all cameras to the training. Off: it serves scoring only, as in a real capture."""

    @property
    def frame_rate(self) -> float:
        """Frames a second that the film plays at."""
        return self.frames / self.seconds if self.fps is None else self.fps


class MotionParams(Section):
    """When `stabilize: auto` stabilises: if either is exceeded in any frame, against the mean pose."""

    degrees: Annotated[float, Field(ge=0, le=180)] = 2.0
    """Turn of the head."""

    shift: Annotated[float, Field(ge=0, le=10)] = 0.02
    """Shift of the head, shares of the tracked mesh's largest extent (of a head about 5 mm)."""


class RegistrationParams(Section):
    """How poses are found from the pictures (training/registration.py)."""

    stride: Count = 3
    """Every so-manieth pixel of each camera's picture of the reference frame is a point, if it shows the subject."""

    scales: Annotated[Many[Share], Field(min_length=1)] = (0.032, 0.016, 0.008, 0.004)
    """Blurs, from coarse to fine, standard deviations in shares of the picture's shorter side: the first bridges what
    moves in a frame, the last is a pixel of 250."""

    rounds: Natural = 3
    """How often the depth of the points is corrected, and all frames are laid over the reference anew."""

    max_deeper: Length = 0.01
    """Units that a correction moves them at most, a voxel of the volume."""

    steps: Count = 12
    """Gauss-Newton steps a scale, at most."""

    enough: Annotated[float, Field(gt=0, le=1)] = 2e-5
    """A scale ends with a step of less, radians and units."""

    damping: Share = 0.001
    """Added to the normal equations, shares of their diagonal."""

    outlier: Factor = 2.0
    """Median residuals at which a point counts half: what performs or shines."""

    min_opacity: Share = 0.9
    """Of the volume on a ray that shows the subject's surface."""

    min_cosine: Share = 0.3
    """Between a point's normal and the direction to the camera."""

    min_points: Count = 200
    """Fewer tell no pose."""

    min_likeness: Share = 0.6
    """A frame whose pictures, at the pose found, correlate with the reference's less than this share of the median
    frame's is refused: its pose is bridged."""

    max_leap: Annotated[float, Field(gt=0, le=180)] = 8.0
    """Degrees between a frame's pose and the middle of its neighbours', beyond which it is refused."""


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

    stabilize: bool | Literal["auto", "found"] = "auto"
    """Whether the model is made in the head's own frame: true moves each frame's cameras by the head's pose, false
    takes the head to stand still, "auto" decides by `motion`. Where the poses of the capture are all alike, those are
    taken that lay its tracked meshes over one another; where it has no tracked mesh, "auto" looks for them in the
    pictures, as "found" does whatever the capture has. See docs/guide/subjects.md."""

    motion: MotionParams = MotionParams()
    """How much motion of the head is much."""

    registration: RegistrationParams = RegistrationParams()
    """How poses are found where the capture has none."""
