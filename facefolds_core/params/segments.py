"""`train.segments`: takes that are too long to be trained at once."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from facefolds_core.params.base import Count, Factor, Many, Natural, Rate, Section, Share


class SegmentParams(Section):
    """A long take: a model of its key frames, the base, and each frame fitted alone against it."""

    joint_frames: Natural = 48
    """Takes of at most so many frames are trained at once, where `memory_megabytes` are enough for it; longer ones in
    segments. 0 trains every take in segments."""

    memory_megabytes: Count = 8192
    """For the textures of a training at once, all its frames together; the rays of 24 cameras of 768 x 512 need 400
    more, Python and its libraries 500. It decides which takes are trained in segments, and how many key frames there
    may be: a fixed number, so that a take gives the same model on every machine."""

    texel_bytes: Factor = 300.0
    """That a texel of one frame takes while it is trained at once: of colour and twelve alphas the values, two
    moments, a copy to go back to, and room to resample. Measured."""

    floor_megabytes: Count = 700
    """Memory that every training takes beside textures and rays: Python, its libraries, the volume."""

    texels_per_pixel: Factor = 3.8
    """Texels of the textures, a pixel of one camera's picture, if a texel is one pixel: what is reckoned with before
    they are known. Measured, of heads that fill the picture."""

    key_frames: Annotated[int, Field(ge=1, le=10_000)] = 24
    """Frames of which the base is made, at most: surfaces, layers, shared colour, backgrounds, reflection. The first
    is the one nearest the mean, each other the one farthest from all before."""

    named: Many[str] = ()
    """Instead, the key frames by their names in the capture. fit.json has those that were chosen: with them written
    here the base stays what it is when the range of frames changes, and only new frames are trained."""

    cameras: Annotated[int, Field(ge=1, le=1000)] = 4
    """Training cameras, evenly spread over their list, whose pictures tell frames apart (the tracked meshes do, too,
    where there are any)."""

    thumbnail: Annotated[int, Field(ge=2, le=256)] = 32
    """Rows of the small grey pictures that are compared."""

    vertices: Count = 512
    """Of a tracked mesh that are compared, at most."""

    neighbours: Annotated[int, Field(ge=1, le=100)] = 3
    """A frame starts from the mean of so many key frames, the ones most like it, weighted by likeness: without a leap
    when another key frame comes near."""

    blend: Annotated[float, Field(ge=0, le=100)] = 0.5
    """How much like the other frames key frames are made: where one stands among the others it is taken to be beside
    them, by so many mean distances between key frames. With 0 they start from themselves alone, and the error leaps
    where one is passed."""

    frames: Count = 12
    """Of a segment: a file of the model, and the most that is lost when a training is killed. The result does not
    depend on it: each frame is fitted by itself."""

    steps: Count = 16
    """Of each frame against the base, all at full resolution."""

    rate: Rate = 1.0
    """Learning rate of a frame's parts against that of the training at once; it falls to `textures.final_rate` of
    itself."""

    checkpoint_seconds: Annotated[float, Field(ge=0, le=1e6)] = 60.0
    """Between checkpoints of a base while it is trained, of which a kill takes no more,"""

    checkpoint_share: Annotated[Share, Field(gt=0)] = 0.05
    """and more where writing one takes more than this share of the time. A checkpoint is as large as the textures and
    their moments, in memory the greatest part."""

    processes: Natural = 0
    """That fit segments at once on this machine, its threads shared out among them. 0: as many as there are cores,
    segments, memory and work (`process_seconds`) for; 1: the training's own. The result does not depend on it."""

    process_seconds: Factor = 20.0
    """Of work on one core that are worth a process: it takes some to begin."""

    ray_nanoseconds: Factor = 1500.0
    """Of one core, a ray and step, of twelve layers: what the time is foretold by. Measured."""

    free_share: Annotated[Share, Field(gt=0)] = 0.9
    """Of the machine's memory that may be asked for; more is refused before it begins."""
