"""`train.segments`: takes that are too long to be trained at once."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from facefolds_core.params.base import Count, Natural, Section


class SegmentParams(Section):
    """A long take: a model of its key frames, the base, and each frame fitted alone against it."""

    joint_frames: Natural = 48
    """Takes of at most so many frames are trained at once if memory allows, longer ones in segments. 0 trains every
    take in segments."""

    memory_megabytes: Count = 8192
    """Memory for the textures of a training at once, MB. A fixed number, so that a take gives the same model on every
    machine."""

    key_frames: Annotated[int, Field(ge=1, le=10_000)] = 24
    """Frames of which the base is made, at most."""

    frames: Count = 12
    """Frames of a segment: the most that is lost when a training is killed."""

    steps: Count = 4
    """Steps of each frame against the base, all at full resolution."""

    processes: Natural = 0
    """Processes that fit segments at once. 0: as many as cores, memory and work allow; 1: the training's own. The
    result does not depend on it."""
