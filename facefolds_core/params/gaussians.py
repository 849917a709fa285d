"""`subject`: who stands where, found before anything is trained."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from facefolds_core.params.base import Count, Section, Seed


class SubjectParams(Section):
    """The subject is found once: Gaussians of one frame, and a matte of every picture. Mattes come from the user
    (`subjects.NAME.mattes`), from the capture, from clean plates, or else from Gaussians and the pictures' colours."""

    iterations: Annotated[int, Field(ge=1, le=1_000_000)] = 2500
    """Steps in which Gaussians are fitted, a picture each."""

    fewest: Count = 9000
    """Gaussians at the end, at least."""

    most: Count = 30_000
    """Gaussians at the end, at most."""

    seed: Seed = 0
    """Seed of what is left to chance."""
