"""`train.segments`: takes that are too long to be trained at once."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from facefolds_core.params.base import Count, Factor, Many, Natural, Rate, Section, Share


class SegmentParams(Section):
    """A long take: a model of its key frames, the base, and each frame fitted alone against it."""

    joint_frames: Natural = 48
    """Takes of at most so many frames are trained at once if memory allows, longer ones in segments. 0 trains every
    take in segments."""

    memory_megabytes: Count = 8192
    """Memory for the textures of a training at once, MB. A fixed number, so that a take gives the same model on every
    machine."""

    texel_bytes: Factor = 300.0
    """Bytes that a texel of one frame takes in a training at once."""

    floor_megabytes: Count = 700
    """Memory that every training takes beside textures and rays, MB."""

    texels_per_pixel: Factor = 3.8
    """Texels that are reckoned with for a pixel of one picture, before they are known."""

    key_frames: Annotated[int, Field(ge=1, le=10_000)] = 24
    """Frames of which the base is made, at most."""

    named: Many[str] = ()
    """Key frames by their names in the capture, instead of a choice. With those of fit.json the base stays when the
    range of frames changes."""

    cameras: Annotated[int, Field(ge=1, le=1000)] = 4
    """Training cameras whose pictures tell frames apart."""

    thumbnail: Annotated[int, Field(ge=2, le=256)] = 32
    """Rows of the small grey pictures that are compared."""

    vertices: Count = 512
    """Vertices of a tracked mesh that are compared, at most."""

    neighbours: Annotated[int, Field(ge=1, le=100)] = 3
    """A frame starts from the mean of so many key frames, weighted by likeness."""

    blend: Annotated[float, Field(ge=0, le=100)] = 0.5
    """How much key frames are made like the others, in mean distances between key frames. With 0 they start from
    themselves alone."""

    frames: Count = 12
    """Frames of a segment: the most that is lost when a training is killed."""

    steps: Count = 16
    """Steps of each frame against the base, all at full resolution."""

    rate: Rate = 1.0
    """Learning rate of a frame's parts against that of the training at once."""

    checkpoint_seconds: Annotated[float, Field(ge=0, le=1e6)] = 60.0
    """Seconds between checkpoints of a base while it is trained, at least."""

    checkpoint_share: Annotated[Share, Field(gt=0)] = 0.05
    """Largest share of the time that writing checkpoints may take."""

    processes: Natural = 0
    """Processes that fit segments at once. 0: as many as cores, memory and work allow; 1: the training's own. The
    result does not depend on it."""

    process_seconds: Factor = 20.0
    """Seconds of work on one core that are worth a process."""

    ray_nanoseconds: Factor = 1500.0
    """Nanoseconds of one core for a ray and step, by which the time is forecast."""

    free_share: Annotated[Share, Field(gt=0)] = 0.9
    """Share of the machine's memory that may be asked for; more is refused."""
