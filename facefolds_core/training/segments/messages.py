"""What a worker process says to its parent."""

from __future__ import annotations

from dataclasses import dataclass

from facefolds_core.errors import UserError


@dataclass(frozen=True)
class FrameDone:
    """A frame of the segment at hand is fitted."""


@dataclass(frozen=True)
class SegmentDone:
    """A segment's file is written.

    Attributes:
        rays: that it took.
        memory: bytes resident in this process, at most until now.
        seconds: of processor, since the process began.
    """

    rays: int
    memory: int
    seconds: float


@dataclass(frozen=True)
class Failed:
    """What a user can mend went wrong."""

    error: UserError
