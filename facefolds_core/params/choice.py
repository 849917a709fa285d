"""How `auto` decides: the least that training views cannot tell from the best."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from facefolds_core.params.base import Count, Many, Section, Share

Decibels = Annotated[float, Field(ge=0, le=100)]


class ChoiceParams(Section):
    """Candidates are rendered and compared with the photos; the least that is good enough is taken."""

    within: Decibels = 0.1
    """Largest loss of PSNR against the photos of the candidate that is taken, to the best one's, dB."""

    fidelity: Decibels = 42.5
    """Least PSNR of its pictures to those of the finest candidate, dB."""

    cameras: Count = 4
    """Cameras that are looked at, evenly spread: those for validation where there are any."""

    frames: Count = 2
    """Frames of each camera, evenly spread."""

    rays: Count = 20_000
    """Pixels of each picture, at most, drawn at random."""

    opaque: Share = 0.9
    """Pixels count where the finest candidate is at least so opaque."""


class MeshChoiceParams(ChoiceParams):
    """How `decimate.resolution: auto` is decided."""

    candidates: Annotated[Many[Annotated[int, Field(ge=8, le=2048)]], Field(min_length=1, max_length=20)] = (
        *(16, 24, 32),
        *(48, 64),
    )
    """R^m that are tried."""


class TextureChoiceParams(ChoiceParams):
    """How `texture.resolution: auto` is decided."""

    within: Decibels = 0.05
    """Largest loss of PSNR to the best candidate, dB. The codec adds a loss of its own."""

    candidates: Annotated[Many[Annotated[int, Field(ge=8, le=4096)]], Field(min_length=1, max_length=20)] = (
        *(128, 192, 256),
        *(384, 512),
    )
    """R^t that are tried, below that of the samples, which is tried, too."""
