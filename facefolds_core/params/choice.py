"""How `auto` decides: the least that training views cannot tell from the best."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from facefolds_core.params.base import Count, Many, Section, Share

Decibels = Annotated[float, Field(ge=0, le=100)]


class ChoiceParams(Section):
    """Candidates are rendered and compared with the photos; the least that is good enough is taken."""

    within: Decibels = 0.1
    """The least candidate is taken whose PSNR against the photos lies at most this far below the best one's, dB,"""

    fidelity: Decibels = 42.5
    """and whose pictures have this PSNR to those of the finest one, dB: about as much as the codec leaves
    (`compress.video.target_psnr`). Where the model itself is far from the photos, these alone would let detail go."""

    cameras: Count = 4
    """That are looked at, evenly spread: those for validation, where there are any, else of the training cameras."""

    frames: Count = 2
    """Of each camera, evenly spread."""

    rays: Count = 20_000
    """Pixels of each picture, at most, drawn at random: enough for hundredths of a dB."""

    opaque: Share = 0.9
    """Pixels count where the finest candidate is so opaque: behind others stands a room that textures do not have."""


class MeshChoiceParams(ChoiceParams):
    """How `decimate.resolution: auto` is decided."""

    candidates: Annotated[Many[Annotated[int, Field(ge=8, le=2048)]], Field(min_length=1, max_length=20)] = (
        *(16, 24, 32),
        *(48, 64),
    )
    """R^m that are tried. Finer meshes than 64 x 64 gained nothing on any capture."""


class TextureChoiceParams(ChoiceParams):
    """How `texture.resolution: auto` is decided."""

    within: Decibels = 0.05
    """As for meshes, but half as much: the codec loses detail of its own, and what both lose adds up to more than the
    sum. 0.10 dB below the best, `mugsy`'s asset lost 0.3 dB to its model instead of 0.1."""

    candidates: Annotated[Many[Annotated[int, Field(ge=8, le=4096)]], Field(min_length=1, max_length=20)] = (
        *(128, 192, 256),
        *(384, 512),
    )
    """R^t that are tried, below that of the samples, which is tried, too."""
